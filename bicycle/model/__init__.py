"""A bicycle with its effects: model files, families, matrices and eigenvalues."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "default_sd": (
            "DEFAULTS",
            "Deviation",
            "EFFECT",
            "ORIGINS",
            "standard_deviations",
        ),
        "descriptor": ("DescriptorStack",),
        "eigen": (
            "BATCH",
            "angular_frequency",
            "damping_ratio",
            "decompose",
            "eigensystem",
            "eigenvalues",
            "frequency_hz",
            "min_damping_ratio",
            "oscillating",
            "pair_damping_ratio",
            "project",
        ),
        "inputs": (
            "InputHistory",
            "doublet",
            "pulse",
            "step",
        ),
        "matrix_model": ("read_matrices",),
        "model": (
            "Model",
            "check_compatible",
            "impossible_bicycles",
            "linear_model",
        ),
        "model_family": ("ModelFamily",),
        "model_file": (
            "SECTION",
            "available_models",
            "build_model",
            "read_model",
        ),
        "state_space": (
            "LinearModel",
            "SpeedRange",
        ),
    },
)
