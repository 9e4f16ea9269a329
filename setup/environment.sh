# Sourced by env.sh and ./cell: forget what another ROS, Python or CMake environment has set in this shell.
# Kept on purpose: ROS_MASTER_URI, ROS_IP, ROS_HOSTNAME, ROS_NAMESPACE, ROS_HOME, ROS_LOG_DIR and pip's mirrors.
unset PYTHONPATH PYTHONHOME PYTHONSTARTUP VIRTUAL_ENV CONDA_PREFIX LD_LIBRARY_PATH
unset ROS_ROOT ROS_DISTRO ROS_VERSION ROS_ETC_DIR ROS_PACKAGE_PATH ROS_PYTHON_VERSION ROSLISP_PACKAGE_DIRECTORIES
unset AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH CMAKE_GENERATOR PKG_CONFIG_PATH DESTDIR
unset CATKIN_SHELL _CATKIN_SETUP_DIR PIP_USER PIP_TARGET PIP_PREFIX
# Debian's tools first: their python3 has to be Debian's, whatever pyenv, conda or a venv puts on PATH.
export PATH="/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
# Packages of a user's own ~/.local must not stand in front of the pinned ones.
export PYTHONNOUSERSITE=1
# The matrices of a robot are small: a second thread of arithmetic only spins, and takes the cores of a live cell.
export OPENBLAS_NUM_THREADS=1
