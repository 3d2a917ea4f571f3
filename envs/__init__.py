"""Gymnasium environments of the bench: excite a rig with a hidden joint so that its record tells as much as possible.

Importing this package registers `IDS`; ``gymnasium.make("envs:JointBench/SDOFExcitation-v0")`` imports it by itself.
"""

from gymnasium.envs.registration import register

IDS = (
    "JointBench/SDOFExcitation-v0",
    "JointBench/JointExcitation-v0",
    "JointBench/Discrimination-v0",
)
"""Registered environments."""


def _register() -> None:
    for identifier in IDS:
        name = identifier.partition("/")[2].removesuffix("-v0")
        register(
            id=identifier,
            entry_point=f"envs.single:{name}Env",
            vector_entry_point=f"envs.vector:{name}VectorEnv",
        )


_register()

__all__ = ["IDS"]
