"""Gymnasium environments of the bench: excite a rig with a hidden joint so that its record tells as much as possible.

Where the project is installed, ``gymnasium.make("JointBench/SDOFExcitation-v0")`` works without any import. In a bare checkout,
importing this package registers `IDS`; ``gymnasium.make("envs:JointBench/SDOFExcitation-v0")`` imports it by itself.
"""

from gymnasium.envs.registration import register, registry

IDS = (
    "JointBench/SDOFExcitation-v0",
    "JointBench/JointExcitation-v0",
    "JointBench/Discrimination-v0",
    "JointBench/ModelExcitation-v0",
)
"""Registered environments."""


def _register() -> None:
    for identifier in IDS:
        name = identifier.partition("/")[2].removesuffix("-v0")
        if identifier in registry:  # by the installed package, which makes the same
            continue
        single, vector = ("model", "model") if name == "ModelExcitation" else ("single", "vector")
        register(
            id=identifier,
            entry_point=f"{__name__}.{single}:{name}Env",
            vector_entry_point=f"{__name__}.{vector}:{name}VectorEnv",
        )


_register()

__all__ = ["IDS"]
