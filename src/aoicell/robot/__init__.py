"""The arm: kinematics from its URDF. The only importer of Pinocchio's models and algorithms."""

from aoicell.robot.arm import Arm

__all__ = ["Arm"]
