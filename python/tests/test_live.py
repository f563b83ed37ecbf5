"""Telemetry and commands: a robot on a socket, as bytes that a robot has sent."""

import socket
import threading

import pytest

import sonarfix as sf


@pytest.fixture
def silent_robot():
    """A socket that takes everything and answers nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=listen, args=(server,))
        thread.start()
        yield f"tcp:127.0.0.1:{server.getsockname()[1]}"
        thread.join()


def listen(server):
    connection, _ = server.accept()
    with connection:
        while connection.recv(1 << 16):
            pass


def test_a_port_that_does_not_exist():
    with pytest.raises(sf.ConnectionFailed, match="cannot open the port"):
        sf.monitor("/dev/not-there")


def test_no_message_in_time(silent_robot):
    with sf.monitor(silent_robot) as robot:
        assert robot.receive(0.05) is None


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), 1e300, -1.0])
def test_hostile_patience(silent_robot, seconds):
    with sf.monitor(silent_robot) as robot, pytest.raises(sf.InputError):
        robot.receive(seconds)


def test_a_command_without_an_answer(silent_robot):
    with sf.monitor(silent_robot) as robot, pytest.raises(sf.ConnectionFailed, match="no answer"):
        robot.start()


def test_the_end_of_recorded_bytes(tmp_path):
    file = tmp_path / "bytes.bin"
    file.write_bytes(bytes(100))
    with sf.monitor(str(file)) as robot:
        assert list(robot) == []
        with pytest.raises(sf.ConnectionFailed, match="can only be read"):
            robot.start()
