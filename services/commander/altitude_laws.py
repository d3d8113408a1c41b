"""The altitude of the next setpoint from the present one (Section 3.1.2, Eq. 17-20)."""

import math


def exponential_altitude_m(
    altitude_amsl_m: float,
    height_above_pad_m: float,
    switching_height_m: float,
    beta0: float = 0.5,
    beta1: float = 0.1,
) -> float:
    """The exponential law (Eq. 20), on the height above the pad.

    As printed, the step scales the flight altitude, which is right only where the pad lies at altitude 0. Here the height above the pad
    is scaled and the pad's altitude added, `pad + h (1 - beta1 exp(-1 / (h - beta0 h0)))`; both agree in the paper's own setting.

    Args:
        altitude_amsl_m: Present altitude, in the frame of the result.
        height_above_pad_m: Present height above the pad, `h`.
        switching_height_m: `h0`, where the landing mode takes over.
        beta0: Shift, in switching heights.
        beta1: Weight of the exponential: the largest step is this part of the height.

    Returns:
        Altitude of the setpoint, metres, below `altitude_amsl_m` and above the pad.

    Raises:
        ValueError: At or below `beta0 * h0` above the pad, where the exponent changes its sign and the law explodes; the landing mode
            has to take over before.
    """
    argument_m = height_above_pad_m - beta0 * switching_height_m
    if not argument_m > 0.0:
        raise ValueError(
            f"height above the pad {height_above_pad_m} m is not above beta0 h0 = {beta0 * switching_height_m} m"
        )
    pad_altitude_m = altitude_amsl_m - height_above_pad_m
    return pad_altitude_m + height_above_pad_m * (1.0 - beta1 * math.exp(-1.0 / argument_m))


def linear_altitude_m(altitude_amsl_m: float, alpha_mps: float, period_s: float) -> float:
    """The linear law (Eq. 17 and 18): the same step down each time, `h - alpha dt`.

    Args:
        altitude_amsl_m: Present altitude.
        alpha_mps: Speed of the descent (Eq. 19).
        period_s: Time between setpoints.

    Returns:
        Altitude of the setpoint, metres, in the same frame.
    """
    return altitude_amsl_m - alpha_mps * period_s
