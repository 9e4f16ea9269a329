// Read the robot's joints and set its override: jsmodbus, a running cell, no ROS.
const net = require('net')
const Modbus = require('jsmodbus')

const socket = net.connect(Number(process.argv[2] || 5020), '127.0.0.1')
const robot = new Modbus.client.TCP(socket, 1)
socket.on('error', error => { console.error(`no robot answers (${error.code}): start a cell first (./cell up)`); process.exit(1) })
socket.on('connect', async () => {
  const { response } = await robot.readHoldingRegisters(11000, 18) // registers 11001 to 11018
  const bytes = Buffer.from(Uint16Array.from(response.body.valuesAsArray).buffer) // low word first
  console.log('J1 to J9 in deg and mm:', Array.from({ length: 9 }, (_, k) => bytes.readFloatLE(4 * k)).join(' '))
  await robot.writeMultipleRegisters(11100, [50, 0])
  socket.end()
})
