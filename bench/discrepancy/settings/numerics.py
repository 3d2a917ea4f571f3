"""Thresholds of the room `numerics`."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.settings.describing import setting


@dataclass(frozen=True)
class NumericsSettings:
    """The minimisation under the fits."""

    differences: tuple[float, ...] = setting(
        (0.0001, 0.1),
        "Steps of the finite differences, the second where the first leads no further.",
        "Stick-slip makes the cost rough on a small scale; friction on a joint was seen to end there with 5 % more cost.",
        unit="sigmas",
    )
    rough: tuple[float, ...] = setting(
        (0.01, 0.1),
        "The same of a model with a play.",
        (
            "Every impact multiplies a difference, so that a small one tells the slope of a ripple. Of eight starts beside the play of "
            "a servo's gear, fits by steps of 0.0001 came to it from none, of 0.03 from one, of 0.01 from all."
        ),
        unit="sigmas",
    )
    faithful: float = setting(
        0.3,
        "Part of the predicted decrease that a step brings for the updated Jacobian to be kept.",
        "A trust-region ratio.",
    )
    patience: int = setting(3, "Steps after which a minimisation may be given up.", "A cost cut-off.")
    optimism: float = setting(
        4.0, "How many times the decrease that the linearisation promises may still come.", "A cost cut-off."
    )
    noise_level: float = setting(
        1.2,
        "Squared residuals, over their number, up to which a minimisation is carried to its end.",
        "There evidence counts single units.",
    )
    coarse: float = setting(
        1e-3, "Part of what lies beyond that is not worth a step.", "A wrong model is no less wrong for it."
    )
    damping: float = setting(1e-3, "Damping of the first step.", "Levenberg-Marquardt: nearly Gauss-Newton.")
    fresh_trials: int = setting(
        7,
        "Dampings tried with a Jacobian taken at the point.",
        "Powers of ten up to a step that must descend.",
    )
    stale_trials: int = setting(2, "Dampings tried with a Jacobian carried along.", "Then it is taken anew.")
