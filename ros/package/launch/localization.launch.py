"""The node with a lifecycle manager: what nav2's localization_launch.py does for AMCL."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """The node and its manager."""
    names = {
        "robot_file": ("", "robot file of Sonarfix"),
        "map_file": ("", "map file of walls; empty: the grid of /map"),
        "mode": ("host", "host, or bridge for a robot with the firmware of Sonarfix"),
        "port": ("", "serial port of a robot in the mode bridge"),
        "base_frame_id": ("base_footprint", "frame of the robot"),
    }
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in names.items()]
    arguments.append(DeclareLaunchArgument("use_sim_time", default_value="false"))
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in names}
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    node = Node(
        package="sonarfix_ros",
        executable="sonarfix-ros",
        name="sonarfix",
        output="screen",
        parameters=[{**parameters, "use_sim_time": simulated}],
        remappings=[("/tf", "tf"), ("/tf_static", "tf_static")],
    )
    manager = Node(
        package="nav2_lifecycle_manager",
        executable="lifecycle_manager",
        name="lifecycle_manager_localization",
        output="screen",
        parameters=[{"use_sim_time": simulated, "autostart": True, "node_names": ["sonarfix"]}],
    )
    return LaunchDescription([*arguments, node, manager])
