"""Status of a kernel call or of a run."""

(
    RUNNING,
    REACHED,
    SEPARATED,
    LEFT_FACE,
    SINGULAR,
    CHATTERING,
    INCONSISTENT,
    PAINLEVE,
    MODEL_SINGULAR,
    STEP_UNDERFLOW,
    MAX_STEPS,
    EVENT_STALL,
    STIFF,
    NOT_FINITE,
    LAW_FAILED,
    TORQUE_NOT_FINITE,
    TURNED_TOO_FAR,
    UNBOUNDED_FORCE,
    JOINT_LIMIT,
) = range(19)

LARGEST_TILT = 3.1  # of a spatial object; rotation vectors of the laws are limited to pi [rad]
