// Read the robot's joints and set its override: modbus-serial, a running cell, no ROS.
const ModbusRTU = require('modbus-serial')

const robot = new ModbusRTU()
robot.connectTCP('127.0.0.1', { port: Number(process.argv[2] || 5020) }).then(async () => {
  robot.setID(1)
  const { data } = await robot.readHoldingRegisters(11000, 18) // registers 11001 to 11018
  const bytes = Buffer.from(Uint16Array.from(data).buffer) // the low word first
  console.log('J1 to J9 in deg and mm:', Array.from({ length: 9 }, (_, k) => bytes.readFloatLE(4 * k)).join(' '))
  await robot.writeRegisters(11100, [50, 0])
  robot.close()
}).catch(error => { console.error(`no robot answers (${error.message}): start a cell first (./cell up)`); process.exit(1) })
