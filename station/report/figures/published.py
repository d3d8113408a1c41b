"""The numbers that the paper publishes, beside which figures show ours."""

AZIMUTH_BIAS_DEG = 4.007
"""Mean bias of the azimuth (Table 3): published as -4.007 deg from east, which is +4.007 deg from north."""
AZIMUTH_BIAS_MEDIAN_DEG = 4.057
"""The same, median."""
RADIAL_SLOPE = 2.4923e-2
"""alpha_r, the slope of the radial error over the distance (Fig. 12)."""
RADIAL_OFFSET_M = 2.7785e-2
"""beta_r, its value at distance 0 (Fig. 12), metres."""
RADIAL_R2 = 0.94
"""Variance score of that line."""
ANGULAR_R2_MOST = 0.35
"""No line through the angular error explains more."""
DOWN_BIAS_M = 0.4884
"""Mean bias of the height above the pad (Table 3), metres; measured too large."""
DOWN_BIAS_MEDIAN_M = 0.5454
"""The same, median."""
SIGMA_RAW_M = (0.25334, 0.2407, 0.1191)
"""Standard deviations of the errors north, east, down before the correction (Table 4), metres."""
SIGMA_MEAN_M = (0.05293, 0.0595, 0.0119)
"""The same after the correction by the mean biases."""
SIGMA_MEDIAN_M = (0.05454, 0.0594, 0.0119)
"""The same after the correction by the median biases."""
