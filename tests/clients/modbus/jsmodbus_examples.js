// What jsmodbus' documentation shows, against a robot. Usage: jsmodbus_examples.js PORT;
// prints one line of JSON for each check, see ../checks.js.
'use strict'
const net = require('net')
const Modbus = require('jsmodbus')
const { run, same } = require('../checks')
const { float32, toFloat, assignment } = require('./registers')

const port = Number(process.argv[2])
const socket = new net.Socket()
const client = new Modbus.client.TCP(socket, 1, 3000)
const values = async request => (await request).response.body.valuesAsArray

function open (line) {
  return new Promise((resolve, reject) => {
    line.once('connect', resolve)
    line.once('error', reject)
    line.connect({ host: '127.0.0.1', port })
  })
}

async function exception (request) {
  try { await request } catch (error) { return error.response.body.code }
  return 0
}

run('jsmodbus', {
  connect: () => open(socket),
  'read the joints': async () => {
    const words = await values(client.readHoldingRegisters(11000, 18))
    same(Math.round(toFloat(words[4], words[5])), -160)
  },
  'read discrete inputs': async () => {
    same((await values(client.readDiscreteInputs(6000, 2))).slice(0, 2), [1, 1])
  },
  'write and read coils': async () => {
    await client.writeSingleCoil(6006, true)
    await client.writeMultipleCoils(6005, [false, false])
    same((await values(client.readCoils(6000, 7))).slice(0, 7), [1, 1, 1, 0, 0, 0, 0])
  },
  'write and read registers': async () => {
    await client.writeMultipleRegisters(11100, [50, 0])
    await client.writeSingleRegister(11070, 55)
    same(await values(client.readHoldingRegisters(11100, 2)), [50, 0])
    same(await values(client.readHoldingRegisters(11070, 1)), [55])
  },
  'units 0 and 255': async () => {
    for (const unit of [0, 255]) {
      const line = new net.Socket()
      const other = new Modbus.client.TCP(line, unit, 3000)
      await open(line)
      same(await values(other.readHoldingRegisters(11018, 1)), [1])
      line.end()
    }
  },
  'exceptions 2 and 3': async () => {
    same(await exception(client.readDiscreteInputs(9000, 1)), 2)
    same(await exception(client.writeSingleRegister(11070, 101)), 3)
  },
  'several requests at once': async () => {
    const found = await Promise.all(Array.from({ length: 20 }, () => values(client.readHoldingRegisters(11018, 1))))
    same(found, Array(20).fill([1]))
  },
  'assign registers': async () => {
    for (const [address, words] of assignment(40, 15001, 2, 'R[100]', 0)) {
      await client.writeMultipleRegisters(address, words)
    }
    await client.writeMultipleRegisters(15000, float32(2.5))
    same(await values(client.readHoldingRegisters(15000, 2)), float32(2.5))
  }
}).then(() => socket.end())
