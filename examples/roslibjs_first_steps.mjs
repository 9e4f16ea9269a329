// Hear where the twin's joints are and ask for a tool pose: roslibjs 1 or 2, a running cell, no ROS.
import * as roslib from 'roslib'

const { Ros, Topic, Service } = roslib.Ros ? roslib : roslib.default
const ros = new Ros({ url: `ws://127.0.0.1:${process.argv[2] || 9090}` })
ros.on('error', error => { console.error('no gateway answers: start a cell first (./cell up)'); process.exit(1) })
const states = new Topic({ ros, name: '/twin/joint_states', messageType: 'sensor_msgs/JointState' })
const kinematics = new Service({ ros, name: '/forward_kinematics', serviceType: 'scara_msgs/ForwardKinematics' })
states.subscribe(state => {
  states.unsubscribe()
  console.log(state.name.join(' '), state.position.join(' '))
  kinematics.callService({ joint_positions: [0, 0, 0] }, pose => { console.log(JSON.stringify(pose)); process.exit(0) },
    error => { console.error(error); process.exit(1) })
})
