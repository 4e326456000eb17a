"""Slots of :class:`clutter6d.envs.warp_env.WarpVectorEnv`: scenes and tasks on the device."""
