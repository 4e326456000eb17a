"""The robot: kinematics against the simulator, impedance control, contacts, canonical points."""

import mujoco
import numpy as np
import pytest

from clutter6d.geometry import quat_from_yaw, quat_multiply, rotation_error_rad
from clutter6d.seeding import generator
from clutter6d.sim.end_effector import FINGERS, HAND_BOX
from clutter6d.sim.robot import (
    HOME_QPOS,
    JOINT_LOWER_RAD,
    JOINT_NAMES,
    JOINT_TORQUE_NM,
    JOINT_UPPER_RAD,
    add_robot,
    end_effector_points,
    hand_jacobian,
    hand_pose,
    inverse_kinematics,
)

STRETCHED_QPOS = np.array([0.0, 0.6, 0.0, -1.6, 0.0, 2.2, 0.785])
POINTING_DOWN = np.array([0.0, 1.0, 0.0, 0.0])


def robot_spec(*, visuals: bool = False) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.005
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    table = {"size": (0.5, 0.7, 0.025), "pos": (0, 0, -0.025), "contype": 3, "conaffinity": 3}
    spec.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_BOX, **table)
    add_robot(spec, visuals=visuals)
    return spec


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return robot_spec().compile()


def random_configurations(count: int) -> np.ndarray:
    return generator(0, "configurations").uniform(JOINT_LOWER_RAD, JOINT_UPPER_RAD, size=(count, 7))


def test_robot_has_seven_joints_and_seven_motors(model):
    assert (model.nq, model.nv, model.nu) == (7, 7, 7)
    assert tuple(model.joint(i).name for i in range(7)) == JOINT_NAMES
    assert np.array_equal(model.jnt_range, np.stack([JOINT_LOWER_RAD, JOINT_UPPER_RAD], axis=-1))
    assert np.array_equal(model.actuator_forcerange[:, 1], JOINT_TORQUE_NM)


def test_total_mass_is_the_published_one(model):
    assert model.body_mass.sum() == pytest.approx(2.3966 + 15.4947 + 0.6544 + 2 * 0.0291, abs=1e-3)


def test_forward_kinematics_and_jacobian_agree_with_mujoco(model):
    data, configurations = mujoco.MjData(model), random_configurations(100)
    poses, jacobians = hand_pose(configurations), hand_jacobian(configurations)
    linear, angular = np.zeros((3, 7)), np.zeros((3, 7))
    for qpos, pose, jacobian in zip(configurations, poses, jacobians, strict=True):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacBody(model, data, linear, angular, model.body("hand").id)
        np.testing.assert_allclose(pose[:3], data.body("hand").xpos, atol=1e-9)
        assert abs(pose[3:] @ data.body("hand").xquat) > 1 - 1e-12
        np.testing.assert_allclose(jacobian, np.concatenate([linear, angular]), atol=1e-9)


def test_kinematics_of_a_row_does_not_depend_on_the_batch():
    configurations = random_configurations(9)
    assert np.array_equal(hand_pose(configurations)[3:4], hand_pose(configurations[3:4]))
    assert np.array_equal(hand_jacobian(configurations)[3:4], hand_jacobian(configurations[3:4]))
    targets = hand_pose(configurations)
    together, alone = inverse_kinematics(targets, HOME_QPOS), inverse_kinematics(targets[3:4], HOME_QPOS)
    assert np.array_equal(together[0][3:4], alone[0])


def test_hand_reaches_every_place_where_a_target_may_lie_with_any_yaw():
    """Pointing down; half a turn of the hand changes nothing, since its fingers are alike."""
    draws, count = generator(0, "targets"), 300
    places = draws.uniform([-0.15, -0.30, 0.15], [0.15, 0.30, 0.30], size=(count, 3))
    yaw = draws.uniform(-np.pi, np.pi, size=count)
    turned = np.concatenate([yaw, yaw + np.pi])
    targets = np.concatenate(
        [np.tile(places, (2, 1)), quat_multiply(quat_from_yaw(turned), POINTING_DOWN[None])], axis=1
    )
    qpos, converged = inverse_kinematics(targets, HOME_QPOS)
    assert converged.reshape(2, count).any(axis=0).all()
    reached = hand_pose(qpos[converged])
    assert np.abs(reached[:, :3] - targets[converged, :3]).max() < 1e-3
    assert rotation_error_rad(reached[:, 3:], targets[converged, 3:]).max() < 1e-2
    assert ((qpos >= JOINT_LOWER_RAD) & (qpos <= JOINT_UPPER_RAD)).all()


def test_inverse_kinematics_says_so_when_a_pose_is_out_of_reach():
    targets = np.array([[0.9, 0.0, 0.3, *POINTING_DOWN], [0.0, 0.0, 0.3, *POINTING_DOWN]])
    _, converged = inverse_kinematics(targets, HOME_QPOS)
    assert converged.tolist() == [False, True]


def test_home_points_down_high_above_the_near_part_of_the_table(model):
    pose = hand_pose(HOME_QPOS[None])[0]
    np.testing.assert_allclose(pose[:3], [-0.25, 0.0, 0.55], atol=1e-3)
    assert abs(pose[3:] @ POINTING_DOWN) > 1 - 1e-9
    data = mujoco.MjData(model)
    data.qpos[:] = data.ctrl[:] = HOME_QPOS
    mujoco.mj_step(model, data, 200)
    assert np.abs(data.qpos - HOME_QPOS).max() < 1e-4, "gravity is compensated"
    assert data.ncon == 0


def test_home_touches_no_object_of_the_tallest_kind():
    spec = robot_spec()
    size = (0.3, 0.7, 0.175)
    spec.worldbody.add_geom(
        name="wall", type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=(0.05, 0, 0.175), contype=2, conaffinity=3
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = HOME_QPOS
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


@pytest.mark.parametrize(("posture", "overshoot"), [(HOME_QPOS, 0.03), (STRETCHED_QPOS, 0.07)])
@pytest.mark.parametrize("joint", range(7))
def test_a_step_of_a_joint_settles_quickly_and_without_oscillation(model, joint, posture, overshoot):
    data = mujoco.MjData(model)
    data.qpos[:] = data.ctrl[:] = posture
    data.ctrl[joint] += 0.1
    response, torque = [], []
    for _ in range(100):
        mujoco.mj_step(model, data)
        response.append((data.qpos[joint] - posture[joint]) / 0.1)
        torque.append(np.abs(data.actuator_force))
    response = np.array(response)
    assert response.max() < 1 + overshoot
    assert np.abs(response[80:] - 1).max() < 0.05, "settled within 0.4 s at the latest"
    if posture is HOME_QPOS:
        assert np.abs(response[50:] - 1).max() < 0.06, "settled within 0.25 s"
    crossings = np.flatnonzero(np.diff(np.sign(response - 1)))
    assert len(crossings) <= 3
    assert (np.array(torque) < JOINT_TORQUE_NM).all()


def test_robot_meets_objects_and_the_table_but_never_itself(model):
    robot = [i for i in range(model.ngeom) if model.geom(i).name.endswith(("_collision", "_0", "_1"))]
    assert len(robot) == 9
    assert not (model.geom_contype[robot] & model.geom_conaffinity[robot]).any()
    data, touched = mujoco.MjData(model), 0
    for qpos in random_configurations(50):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        touched += data.ncon
        for contact in data.contact:
            assert model.geom("table").id in contact.geom
    assert touched > 0


def test_tip_sites_lie_where_the_collision_fingers_end(model):
    data = mujoco.MjData(model)
    data.qpos[:] = HOME_QPOS
    mujoco.mj_forward(model, data)
    tip, left, right = (data.site(name).xpos for name in ("hand_tip", "finger_left", "finger_right"))
    np.testing.assert_allclose((left + right) / 2, tip, atol=1e-12)
    assert tip[2] == pytest.approx(0.55 - 0.1122, abs=1e-3)
    finger = FINGERS[0]
    assert finger.centre_m[2] + finger.half_length_m + finger.radius_m == pytest.approx(0.1122)


def test_end_effector_points_lie_on_the_outer_surface():
    points = end_effector_points().astype(np.float64)
    assert points.shape == (256, 3)
    shapes = (HAND_BOX, *FINGERS)
    middle = np.array(HAND_BOX.centre_m)
    shrunk, grown = (middle + (points - middle) * factor for factor in (1 - 1e-5, 1 + 1e-5))
    assert np.any([shape.contains(shrunk) for shape in shapes], axis=0).all()
    assert not np.any([shape.contains(grown) for shape in shapes], axis=0).any()
    assert len(np.unique(points, axis=0)) == 256
    fingers = (points[:, 2] > 0.067).mean()
    assert 0.03 < fingers < 0.15


def test_visuals_do_not_change_the_physics(model):
    shown = robot_spec(visuals=True).compile()
    assert np.array_equal(shown.body_inertia, model.body_inertia)
    states = []
    for each in (model, shown):
        data = mujoco.MjData(each)
        data.qpos[:], data.ctrl[:] = HOME_QPOS, HOME_QPOS + 0.1
        mujoco.mj_step(each, data, 50)
        states.append(data.qpos.copy())
    assert np.array_equal(*states)
