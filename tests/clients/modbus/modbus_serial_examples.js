// What modbus-serial's documentation shows, against a robot. Usage: modbus_serial_examples.js PORT;
// prints one line of JSON for each check, see ../checks.js.
'use strict'
const ModbusRTU = require('modbus-serial')
const { run, same } = require('../checks')
const { float32, toFloat, assignment } = require('./registers')

const client = new ModbusRTU()
client.setTimeout(3000)

async function exception (request) {
  try { await request } catch (error) { return error.modbusCode }
  return 0
}

run('modbus-serial', {
  connect: async () => {
    await client.connectTCP('127.0.0.1', { port: Number(process.argv[2]) })
    client.setID(1)
  },
  'read the joints': async () => {
    const { data } = await client.readHoldingRegisters(11000, 18)
    same(Math.round(toFloat(data[4], data[5])), -160)
  },
  'read discrete inputs': async () => {
    same((await client.readDiscreteInputs(6000, 2)).data.slice(0, 2), [true, true])
  },
  'write and read coils': async () => {
    await client.writeCoil(6006, true)
    await client.writeCoils(6005, [false, false])
    same((await client.readCoils(6000, 7)).data.slice(0, 7), [true, true, true, false, false, false, false])
  },
  'write and read registers': async () => {
    await client.writeRegisters(11100, [50, 0])
    await client.writeRegister(11070, 55)
    same((await client.readHoldingRegisters(11100, 2)).data, [50, 0])
    same((await client.readHoldingRegisters(11070, 1)).data, [55])
  },
  'functions 22 and 23': async () => { await client.maskWriteRegister(11069, 0, 7) },
  'units 0 and 255': async () => {
    for (const unit of [0, 255]) {
      client.setID(unit)
      same((await client.readHoldingRegisters(11018, 1)).data, [1])
    }
    client.setID(1)
  },
  'exceptions 2 and 3': async () => {
    same(await exception(client.readDiscreteInputs(9000, 1)), 2)
    same(await exception(client.writeRegister(11070, 101)), 3)
  },
  'several requests at once': async () => {
    const found = await Promise.all([
      ...Array.from({ length: 20 }, () => client.readHoldingRegisters(11018, 1)),
      client.readDiscreteInputs(6000, 1),
      client.readHoldingRegisters(11070, 1)
    ])
    same(found.slice(0, 20).map(one => one.data), Array(20).fill([1]))
    same([found[20].data[0], found[21].data], [true, [55]])
  },
  'assign registers': async () => {
    for (const [address, words] of assignment(40, 15001, 2, 'R[100]', 0)) {
      await client.writeRegisters(address, words)
    }
    await client.writeRegisters(15000, float32(2.5))
    same((await client.readHoldingRegisters(15000, 2)).data, float32(2.5))
  }
}).then(() => client.close(() => process.exit(0)))
