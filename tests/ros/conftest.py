"""How to test a node: real ``rosrun``, own master, own namespace, nothing left behind.

The fixtures are in tests/conftest.py (the system tests use them too). ``ros`` is for one test,
``ros_module`` keeps its nodes for all tests of a module. All names are relative to the namespace of
the test::

    from scara_msgs.srv import MoveTo
    from sensor_msgs.msg import JointState

    def test_refuses_what_is_out_of_reach(ros):
        node = ros.run("scara_control", "motion_server", "_config_dir:=" + str(folder))
        move_to = ros.service("move_to", MoveTo)          # waits for it; a call has a deadline
        assert not move_to(x=0.9, y=0, z=0).success
        state = ros.wait_for_message("twin/joint_states", JointState, timeout=5)
        states = ros.collect("twin/joint_states", JointState)   # a list that grows
        ros.wait_until(lambda: len(states) > 100, timeout=5, what="100 states")
        jog = ros.publisher("joint_vel_controller/command", JointJog)   # waits for a listener
        assert node.stop() == 0 and "Traceback" not in node.output

``ros.run(...)`` returns at once: a process with ``pid``, ``poll()``, ``wait(timeout)``, ``stop()``,
``signal(number)``, ``output``. ``ros.shell("rosservice", "call", ...)`` runs a tool to its end and
returns what it printed. ``ros.env`` is the environment, ``ros.free_port()`` a port for Modbus or a
web socket, ``ros.name("x")`` the absolute name, ``ros.folder`` a folder for files. When a test
fails the last lines of every process are in its report.
"""
