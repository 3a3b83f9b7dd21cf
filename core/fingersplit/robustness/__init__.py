"""How probably a grasp holds although pose, friction and mass are known only so well: `p_hold` in two tiers."""
