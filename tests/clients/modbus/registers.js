// The words of the robot's registers, for the Node.js clients: it needs no client and nothing of the project.
'use strict'

// The words of a number, the low one first, and back.
exports.float32 = function (value) {
  const bytes = Buffer.alloc(4)
  bytes.writeFloatLE(value)
  return [bytes.readUInt16LE(0), bytes.readUInt16LE(2)]
}
exports.toFloat = function (low, high) {
  const bytes = Buffer.alloc(4)
  bytes.writeUInt16LE(low, 0)
  bytes.writeUInt16LE(high, 2)
  return bytes.readFloatLE(0)
}

// The words of a text, the first character in the high byte.
const text = exports.text = function (value) {
  const bytes = Buffer.alloc(80)
  bytes.write(value, 'ascii')
  return Array.from({ length: 40 }, (_, k) => bytes.readUInt16BE(2 * k))
}

// The requests that assign an entry of $SNPX_ASG: PDU address and words, in their order.
exports.assignment = function (slot, address, size, variable, factor) {
  const fields = [
    ['$ADDRESS', [address, 0], 1],
    ['$SIZE', [size, 0], 1],
    ['$VAR_NAME', text(variable), -1],
    ['$MULTIPLY', exports.float32(factor), 0]
  ]
  return fields.flatMap(([field, words, by]) => [
    [16299, [16000, 0, words.length, 0, ...text(`$SNPX_ASG[${slot}].${field}`), ...exports.float32(by)]],
    [15999, words]
  ])
}
