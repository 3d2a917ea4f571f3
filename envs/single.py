"""The three environments, one bench each."""

from __future__ import annotations

from .bench_env import BenchEnv


class SDOFExcitationEnv(BenchEnv):
    """Excite a single-degree-of-freedom rig so that its unknown joint can be identified.

    ## Description

    A carriage of 2 kg on a spring and a damper is driven by a weak shaker against an unknown joint. Each step shapes the next
    window of the shaker's force; each episode hides another rig. The aim is an excitation from which the joint's parameters can
    be told, within limits on stroke, velocity, force and energy. Pumping the resonance moves the carriage far enough to reach
    the dead-space or to yield the joint, but its frequency is not known, and the stroke is limited.

    Hidden rig, drawn anew in every episode; the kind of joint first, each as likely:

    | Unknown | Unit | Smallest | Largest | Distribution | Joint |
    |---|---|---|---|---|---|
    | spring stiffness | N/m | 200 | 400 | log-uniform | all |
    | damping | N s/m | 0.8 | 3 | log-uniform | all |
    | contact stiffness | N/m | 300 | 1500 | log-uniform | gap |
    | clearance to each side | m | 0.005 | 0.03 | log-uniform | gap |
    | A (stiffness before yield) | N/m | 15 | 80 | log-uniform | bouc_wen |
    | beta | 1/m | 20 | 70 | log-uniform | bouc_wen |
    | gamma | 1/m | 5 | 30 | log-uniform | bouc_wen |
    | friction force | N | 0.1 | 1 | log-uniform | coulomb |

    The yield level of a Bouc-Wen joint is A / (beta + gamma), 0.15 to 3.2 N.

    ## Action Space

    `Box(-1, 1, (n_knots,), float32)` for `shaping="knots"`:

    | Num | Action | Min | Max | Name in the XML | Unit of ±1 |
    |---|---|---|---|---|---|
    | k | force at the end of part k of the window, reached along half a cosine | −1 | 1 | shaker | 2 N |

    `Box(-1, 1, (2,), float32)` for `shaping="amplitude_frequency"`:

    | Num | Action | Min | Max | Name in the XML | Range |
    |---|---|---|---|---|---|
    | 0 | amplitude at the end of the window | −1 | 1 | shaker | 0 … 2 N |
    | 1 | frequency at the end of the window | −1 | 1 | shaker | 0.5 … 5 Hz, in octaves |

    ## Observation Space

    `Box(-1, 1, (n,), float32)`: what the laboratory measured in the last window (of W steps, 4 by default) and what the
    experimenter's own records show. Values beyond ±1 are cut off there. Nothing of the hidden rig but its noisy measurements.

    | Num | Observation | Min | Max | Name in the XML | Unit of ±1 | Noise (std) |
    |---|---|---|---|---|---|---|
    | 3 i | displacement at step i = 0 … W − 1 | −1 | 1 | displacement | 0.04 m | 0.5 mm |
    | 3 i + 1 | velocity at step i | −1 | 1 | velocity | 0.6 m/s | 10 mm/s |
    | 3 i + 2 | acceleration at step i | −1 | 1 | acceleration | 10 m/s² | 0.2 m/s² |
    | 3 W + i | force at step i | −1 | 1 | shaker | 2 N | – |
    | then | last action | −1 | 1 | – | as above | – |
    | then | time since the start | −1 | 1 | – | −1 start, 1 end | – |
    | then | energy spent | −1 | 1 | – | −1 none, 1 all | – |
    | then | largest stroke so far | −1 | 1 | – | −1 none, 1 the limit | – |
    | then | largest velocity so far | −1 | 1 | – | −1 none, 1 the limit | – |

    ## Rewards

    The growth of the merit [nat] in the window, less the cost. The merit is ``log det(I + F)`` of the Fisher information F of the
    record so far, whitened by the noise and by the prior's standard deviations, so that directions of the parameter space that
    the record leaves open add nothing. It is averaged over a fixed set of prior draws, never taken at the hidden rig:
    with `average="prior"` with the prior's weights; with "posterior" with weights that follow from the measurements so far.
    With `reward="coverage"` the merit is that of `bench.excitation.Coverage` instead: cells of state and memory, within the
    limits of stroke and velocity, that the measured motion has entered. It needs no draws and knows of no law.

    With `reward="error"` the merit is minus the logarithm of the error that an identification of the hidden rig is expected to have,
    root mean square over its parameters in prior standard deviations. The hidden rig then has a background, of which
    the identification knows nothing: quadratic and cubic stiffness and quadratic damping beside its joint, each with a force at the
    limit of 0.2 N (standard deviation). This reward knows the hidden rig, as a teacher may; observations do not. Rigs are compiled
    ones in place of MuJoCo's, equal to rounding, and are not rendered; `average` and `n_draws` mean nothing.

    | Limit | Value | What happens |
    |---|---|---|
    | force | 2 N | cannot be exceeded: actions are fractions of it |
    | energy, dt Σ u² | 10 N² s | the window that would exceed it is scaled down; the episode ends, at no cost |
    | stroke | 0.04 m | "terminate": the limit switch ends the episode, cost `penalty`; "cost": as velocity |
    | velocity | 0.6 m/s | cost `penalty` times the excess over the limit, as a fraction of it, at most 1 |

    ## Starting State

    The rig at rest at zero; the first observation is the sensors' noise.

    ## Episode End

    Terminated by the limit switch or when the energy is used up; truncated after `duration`.

    ## Information

    Python floats: `merit`, `gain` (its growth) [nat], `cost` [nat], `stroke`, `velocity`, `force` (largest in the window, as
    fractions of the limits), `energy` (spent, as a fraction), `time` [s], `effective_draws` (one over the sum of the squared weights
    of the draws), `separated` (0 here); and the bool `violation` (stroke or velocity over its limit in this window).

    ## Arguments

    | Argument | Default | Meaning |
    |---|---|---|
    | `laws` | ("gap", "bouc_wen", "coulomb") | joints that may be hidden |
    | `shaping` | "knots" | or "amplitude_frequency" |
    | `n_knots` | 1 | knots a window |
    | `window` | 0.04 s | duration of a step |
    | `duration` | 8 s | duration of an episode |
    | `enforcement` | "terminate" | or "cost": what passing the stroke limit does |
    | `penalty` | 10 nat | size of the cost |
    | `reward` | "information" | or "coverage" of states and memory of a joint of unknown kind, or "error" that an identification leaves |
    | `average` | "prior" | or "posterior": weights of the draws in the reward |
    | `n_draws` | two a law | prior draws in the reward |
    | `render_mode` | None | "rgb_array" or "human" |

    ```python
    import envs, gymnasium
    env = gymnasium.make("JointBench/SDOFExcitation-v0", shaping="amplitude_frequency")
    ```

    ## References

    Tasbihgoo 2006, chapter 2 (the rig); Chaloner, Verdinelli 1995, Statistical Science 10(3) (the merit).

    ## Version History

    * v0: first version
    """

    kind = "sdof"


class JointExcitationEnv(BenchEnv):
    """Excite an axial-torsional joint with two loads so that its clearances, contacts and coupling can be identified.

    ## Description

    Two bodies on lightly damped mounts, joined by a joint with dead-space in both directions and a damping in each that sets in
    once the other has passed its clearance. A force and a torque act on the first body. The coupling shows only while both
    directions are far out at the same time. As in `SDOFExcitationEnv` in all else.

    Hidden rig, drawn anew in every episode; the joint's springs and dampers at rest are known:

    | Unknown | Unit | Smallest | Largest | Distribution |
    |---|---|---|---|---|
    | axial contact stiffness | N/m | 5e4 | 3e5 | log-uniform |
    | axial clearance to each side | m | 0.002 | 0.008 | log-uniform |
    | axial damping beyond the torsional clearance | N s/(m rad) | 3e3 | 5e4 | log-uniform |
    | torsional contact stiffness | N m/rad | 35 | 200 | log-uniform |
    | torsional clearance to each side | rad | 0.08 | 0.32 | log-uniform |
    | torsional damping beyond the axial clearance | N s/rad | 50 | 1000 | log-uniform |

    ## Action Space

    `Box(-1, 1, (2 n_knots,), float32)` for `shaping="knots"`:

    | Num | Action | Min | Max | Name in the XML | Unit of ±1 |
    |---|---|---|---|---|---|
    | 2 k | force at the end of part k of the window | −1 | 1 | force | 800 N |
    | 2 k + 1 | torque at the end of part k of the window | −1 | 1 | torque | 16 N m |

    `Box(-1, 1, (4,), float32)` for `shaping="amplitude_frequency"`:

    | Num | Action | Min | Max | Name in the XML | Range |
    |---|---|---|---|---|---|
    | 0, 1 | amplitude and frequency of the force | −1 | 1 | force | 0 … 800 N, 1.5 … 12 Hz |
    | 2, 3 | amplitude and frequency of the torque | −1 | 1 | torque | 0 … 16 N m, 1.5 … 12 Hz |

    ## Observation Space

    `Box(-1, 1, (n,), float32)`, by step of the last window (W steps, 4 by default), then the experimenter's records:

    | Num | Observation | Min | Max | Name in the XML | Unit of ±1 | Noise (std) |
    |---|---|---|---|---|---|---|
    | 6 i | axial displacement of the joint | −1 | 1 | axial | 0.015 m | 0.2 mm |
    | 6 i + 1 | rotation of the joint | −1 | 1 | torsional | 0.6 rad | 8 mrad |
    | 6 i + 2 | axial velocity of the joint | −1 | 1 | axial_velocity | 0.6 m/s | 8 mm/s |
    | 6 i + 3 | rotation rate of the joint | −1 | 1 | torsional_velocity | 24 rad/s | 0.3 rad/s |
    | 6 i + 4 | displacement of body 1 | −1 | 1 | displacement_1 | 0.015 m | 0.2 mm |
    | 6 i + 5 | rotation of body 1 | −1 | 1 | rotation_1 | 0.6 rad | 8 mrad |
    | 6 W + 2 i | force at step i | −1 | 1 | force | 800 N | – |
    | 6 W + 2 i + 1 | torque at step i | −1 | 1 | torque | 16 N m | – |
    | then | last action, time, energy (2), largest stroke, largest velocity | −1 | 1 | – | as in `SDOFExcitationEnv` | – |

    ## Rewards

    As in `SDOFExcitationEnv`, with the limits: force 800 N, torque 16 N m (by construction); energy 8e5 N² s and 320 (N m)² s (scaled
    down; the episode ends when both are used up); stroke of the joint 0.015 m and 0.6 rad; velocity of the joint 0.6 m/s and 24 rad/s.
    With `reward="error"` the background acts on both joints, with 80 N and 1.6 N m at the limits (standard deviation).

    ## Starting State

    The rig at rest at zero.

    ## Episode End

    Terminated by the limit switch or when both energies are used up; truncated after `duration`.

    ## Information

    As in `SDOFExcitationEnv`; fractions are the larger of the two directions'.

    ## Arguments

    Those of `SDOFExcitationEnv` but `laws`; `window` 0.02 s, `duration` 4 s, `n_draws` 4.

    ```python
    import envs, gymnasium
    env = gymnasium.make("JointBench/JointExcitation-v0", n_draws=6)
    ```

    ## References

    Tasbihgoo 2006, section 4.2 and appendix B.1 (the rig and its joint; the mounts' damping is lower here).

    ## Version History

    * v0: first version
    """

    kind = "joint"


class DiscriminationEnv(BenchEnv):
    """Excite a rig so that two rival explanations of its joint can be told apart.

    ## Description

    Each episode asks one of the questions below, and hides a rig of which one of the two explanations is true, each as likely.
    `rig="joint"` is the rig of `JointExcitationEnv`, all effects of one direction acting axially beside the joint's spring; with
    `rig="sdof"` it is that of `SDOFExcitationEnv`, where the last question cannot be asked.

    | Question | One effect | Its rival |
    |---|---|---|
    | gap_cubic | dead-space | cubic stiffness |
    | presliding_bouc_wen | elastic slip (Jenkins) | Bouc-Wen hysteresis |
    | coulomb_stribeck | Coulomb friction | friction that weakens with velocity |
    | axial_gap_coupling | axial dead-space | damping that couples the directions |

    Ranges on the rig "sdof"; on the rig "joint" forces are 250 times and lengths 0.25 times as large (contact stiffness 200 times),
    spring and damper are known, and the coupling has 3e3 … 5e4 N s/(m rad), 50 … 1000 N s/rad, clearances 1 … 5 mm, 0.05 … 0.25 rad:

    | Unknown | Unit | Smallest | Largest | Distribution |
    |---|---|---|---|---|
    | spring stiffness; damping | N/m; N s/m | 200; 0.8 | 400; 3 | log-uniform |
    | gap: contact stiffness; clearance | N/m; m | 300; 0.005 | 1500; 0.02 | log-uniform |
    | cubic: k3 | N/m³ | 5e4 | 2e6 | log-uniform |
    | Jenkins: stiffness; slip force | N/m; N | 20; 0.4 | 60; 1.5 | log-uniform |
    | Bouc-Wen: A; beta; gamma | N/m; 1/m; 1/m | 20; 20; 5 | 100; 70; 30 | log-uniform |
    | Coulomb: friction force | N | 0.1 | 1 | log-uniform |
    | Stribeck: sliding force; boost; velocity | N; 1; m/s | 0.1; 0.1; 0.03 | 0.8; 0.8; 0.2 | log-uniform |

    ## Action Space

    As in `JointExcitationEnv` (rig "joint") or `SDOFExcitationEnv` (rig "sdof").

    ## Observation Space

    As there, and at the end which question is asked:

    | Num | Observation | Min | Max | Name in the XML | Unit |
    |---|---|---|---|---|---|
    | last | 1 for the question asked, one entry for each of `pairs` | 0 | 1 | – | – |

    ## Rewards

    The growth of the merit in the window, less the cost (limits and costs as in the other environments). The merit is
    ``log(1 + K)``, K the expected log Bayes factor [nat] in favour of the truth between a rig of the one explanation and the rig of
    the other that imitates it best, averaged over a fixed set of such pairs, never taken at the hidden rig. What a rival could
    make up by other parameters does not count towards K.

    ## Starting State

    The rig at rest at zero.

    ## Episode End

    Terminated by the limit switch, when the energy is used up, or, with `terminate_when_certain`, when every pair of prior draws is
    expected to be told apart with 99 % certainty (K ≥ log 99); truncated after `duration`.

    ## Information

    As in `SDOFExcitationEnv`; `separated` is the share of the pairs that are expected to be told apart with 99 % certainty.

    ## Arguments

    Those of the other environments but `laws`; `reward` is "information". And:

    | Argument | Default | Meaning |
    |---|---|---|
    | `rig` | "joint" | or "sdof" |
    | `pairs` | all that the rig allows | questions |
    | `n_draws` | 4 | pairs of prior draws a question |
    | `terminate_when_certain` | False | end the episode once all pairs are separated |

    ```python
    import envs, gymnasium
    env = gymnasium.make("JointBench/Discrimination-v0", rig="sdof", pairs=("gap_cubic",))
    ```

    ## References

    Kass, Raftery 1995, J. American Statistical Association 90(430); Box, Hill 1967, Technometrics 9(1).

    ## Version History

    * v0: first version
    """

    kind = "discrimination"
