import signal
import socket
import subprocess
import sys
import threading
import urllib.request

import msgpack
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from clutter6d.cli import run
from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.eval.policy import PolicyInput
from clutter6d.eval.policy_loading import load_policy
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.cli import PROGRAM
from dapl_baselines.serving.client import PolicyClient, PolicyServerError
from dapl_baselines.serving.onnx_policy import OnnxPolicy
from dapl_baselines.serving.server import MAX_CLIENTS
from dapl_baselines.serving.wire import MAX_MESSAGE_BYTES, pack
from tests.dapl_baselines.serving.conftest import DAPL
from tests.dapl_baselines.serving.running_server import running

WITHOUT_PYTORCH = """
import sys
for name in ("torch", "tensordict", "rsl_rl", "onnx"):
    sys.modules[name] = None
from dapl_baselines.cli import main
main()
"""
"""A computer on which the training stack cannot be imported."""


@pytest.fixture(scope="module")
def server(checkpoints):
    """A server of a checkpoint, shared by tests that leave it as it was."""
    with running(*DAPL, "serve", str(checkpoints["points"])) as started:
        yield started


@pytest.fixture
def client(server):
    with PolicyClient(port=server.port, timeout_s=60) as connected:
        yield connected


def in_process(checkpoint, observation):
    """The action of the policy as an evaluation would ask for it."""
    rows = {name: value[None] for name, value in observation.items()}
    inputs = PolicyInput(slots=np.array([0]), episodes=(), steps=np.array([0]), observation=rows, states=None)
    return load_policy(str(checkpoint)).act(inputs)[0]


def observations(count):
    rng = np.random.default_rng(2)
    return [
        {name: rng.normal(scale=0.2, size=shape).astype(np.float32) for name, shape in OBSERVATION_SHAPES.items()}
        for _ in range(count)
    ]


def test_actions_are_those_of_the_policy_in_process_to_the_bit(client, checkpoints):
    for observation in observations(3):
        action = client.act(observation)
        assert (action.dtype, action.shape) == (np.float32, (7,))
        assert np.array_equal(action, in_process(checkpoints["points"], observation))


def test_a_client_is_first_told_what_the_policy_is(client, checkpoints):
    told = client.metadata
    assert told["policy_hash"] == read_checkpoint(checkpoints["points"]).header.policy_hash()
    assert told["policy"] == "dapl-policy"
    assert told["observation"]["object_points"] == {"dtype": "float32", "shape": [512, 7]}
    assert told["actions"] == {"dtype": "float32", "shape": [1, 7], "unit": "rad"}
    assert told["control_step_s"] == 0.1


def test_a_client_of_openpi_is_served(server, observation, checkpoints):
    """Spelled out byte by byte: metadata first, then one map of arrays to another; no compression."""
    with connect(f"ws://127.0.0.1:{server.port}", compression=None, max_size=None) as connection:
        assert msgpack.unpackb(connection.recv())["policy"] == "dapl-policy"
        entries = {
            name: {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
            for name, value in observation.items()
        }
        connection.send(msgpack.packb(entries))
        answer = msgpack.unpackb(connection.recv())
    actions = answer["actions"]
    assert (actions[b"dtype"], actions[b"shape"]) == ("<f4", [1, 7])
    assert actions[b"data"] == in_process(checkpoints["points"], observation).tobytes()
    assert answer["server_timing"]["infer_ms"] > 0


def test_clients_are_served_side_by_side(server, checkpoints):
    """Eight connected at once, each with an observation of its own, several times over."""
    cases, found = observations(8), {}
    expected = [in_process(checkpoints["points"], case) for case in cases]

    def ask(number):
        with PolicyClient(port=server.port, timeout_s=60) as each:
            found[number] = [each.act(cases[number]) for _ in range(3)]

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for number, action in enumerate(expected):
        assert all(np.array_equal(each, action) for each in found[number])


def test_too_many_clients_are_told_so(server):
    address = f"ws://127.0.0.1:{server.port}"
    opened = [connect(address, compression=None) for _ in range(MAX_CLIENTS)]
    try:
        assert all(connection.recv(60) for connection in opened)
        with pytest.raises(PolicyServerError, match=f"not as a policy server: .*{MAX_CLIENTS} clients are connected"):
            PolicyClient(port=server.port)
    finally:
        for connection in opened:
            connection.close()


HOSTILE = {
    "nothing": (b"", "not a MessagePack message"),
    "text": ("hello", "a text message"),
    "cut": (pack({"joint_state": np.zeros(14, np.float32)})[:-1], "not a MessagePack message"),
    "a number": (pack(3), "the message holds int"),
    "objects": (
        msgpack.packb({"joint_state": {b"__ndarray__": True, b"dtype": "|O", b"shape": [1], b"data": bytes(8)}}),
        "not made of numbers",
    ),
    "another name": (pack({"prompt": 1}), "unknown entry 'prompt'"),
    "too few": (pack({"joint_state": np.zeros(14, np.float32)}), "is missing"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_observation_is_answered_by_one_line_and_the_connection_stays(server, observation, name):
    message, said = HOSTILE[name]
    with connect(f"ws://127.0.0.1:{server.port}", compression=None) as connection:
        connection.recv(60)
        connection.send(message)
        answer = connection.recv(60)
        assert isinstance(answer, str)
        assert answer.startswith("error: ")
        assert said in answer
        assert "\n" not in answer
        connection.send(pack(observation))
        assert isinstance(connection.recv(60), bytes)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(client, observation, wrong):
    observation["joint_state"][3] = wrong
    with pytest.raises(PolicyServerError, match="'joint_state' holds values that are not finite"):
        client.act(observation)


def test_wrong_types_and_shapes_are_refused(client, observation):
    with pytest.raises(PolicyServerError, match=r"is float64\(9,\), expected float32\(9,\)"):
        client.act({**observation, "hand_state": np.zeros(9)})
    with pytest.raises(PolicyServerError, match=r"is float32\(511, 7\)"):
        client.act({**observation, "object_points": observation["object_points"][1:]})


def test_a_message_that_is_too_long_ends_the_connection_and_no_other(server, client, observation):
    with connect(f"ws://127.0.0.1:{server.port}", compression=None) as connection:
        connection.recv(60)
        with pytest.raises(ConnectionClosed, match="1009"):  # noqa: PT012  which of the two finds out is a race
            connection.send(bytes(MAX_MESSAGE_BYTES + 1))
            connection.recv(60)
    assert client.act(observation).shape == (7,)


def test_a_web_page_is_refused_and_a_health_check_answered(server):
    with pytest.raises(InvalidStatus, match="403"):
        connect(f"ws://127.0.0.1:{server.port}", origin="https://example.com")
    with urllib.request.urlopen(f"http://127.0.0.1:{server.port}/healthz") as answer:
        assert answer.read() == b"OK\n"


def test_a_client_survives_a_killed_server(checkpoints, observation):
    with running(*DAPL, "serve", "zero") as first:
        client = PolicyClient(port=first.port, timeout_s=60)
        assert not client.act(observation).any()
        assert first.stop(signal.SIGKILL)[0] == -signal.SIGKILL
        with pytest.raises(PolicyServerError, match="connection closed"):
            client.act(observation)
        with pytest.raises(PolicyServerError, match="no policy server answers"):
            client.reset()
        with running(*DAPL, "serve", "zero", port=first.port) as second:
            client.reset()
            assert not client.act(observation).any()
            with socket.create_connection(("127.0.0.1", second.port)) as stranger:
                stranger.sendall(b"\x00\xff no websocket \r\n\r\n")
                stranger.recv(1000)
            code, out = second.stop(signal.SIGINT)
            assert (code, out) == (0, "stopped\n")
            with pytest.raises(PolicyServerError, match="going away"):
                client.act(observation)


def test_an_exported_policy_is_served_where_pytorch_cannot_be_imported(export, observation):
    expected = OnnxPolicy(export("state")).act(0, observation)
    with running(sys.executable, "-c", WITHOUT_PYTORCH, "serve", str(export("state"))) as server:
        with PolicyClient(port=server.port, timeout_s=60) as client:
            assert client.metadata["action_scale_rad"] == 0.1
            assert set(client.metadata["observation"]) == {
                "hand_state", "joint_state", "relative_goal", "previous_action",
            }  # fmt: skip
            assert np.array_equal(client.act(observation), expected)
        assert server.stop(signal.SIGTERM) == (0, "stopped\n")


def test_the_client_needs_numpy_msgpack_and_websockets_alone():
    script = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        top = name.split(".")[0]
        if top in ("clutter6d", "torch", "pydantic", "mujoco", "scipy", "jaxtyping", "onnxruntime", "rich", "typer"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Refuse())
from dapl_baselines.serving.client import PolicyClient
"""
    assert subprocess.run([sys.executable, "-c", script], capture_output=True).stderr == b""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["random"], "policy 'random' cannot be served: it failed"),
        (["planner"], "sees the simulator's state"),
        (["missing.pt"], "checkpoint not found"),
        (["{here}"], "make one with: dapl export"),
        (["zero", "--port", "{taken}"], "choose another, or port 0"),
        (["zero", "--host", "203.0.113.7", "--port", "0"], "choose another, or port 0"),
    ],
)
def test_what_cannot_be_served_is_said_in_one_line(tmp_path, capsys, arguments, said):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        values = {"here": tmp_path, "taken": taken.getsockname()[1]}
        assert run(["serve", *(item.format(**values) for item in arguments)], PROGRAM) == 2
    shown = capsys.readouterr().err
    assert said in shown
    assert shown.count("\n") == 1
