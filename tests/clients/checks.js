// What the scripts of the Node.js clients share: it needs no client and nothing of the project.
'use strict'
const fs = require('fs')
const path = require('path')

// Print name and version, then each check and what went wrong, null if nothing did.
exports.run = async function (client, checks) {
  const found = path.join(process.env.NODE_PATH, client, 'package.json')
  console.log(JSON.stringify({ client, version: JSON.parse(fs.readFileSync(found)).version }))
  for (const [check, act] of Object.entries(checks)) {
    let wrong = null
    try { await act() } catch (error) { wrong = String(error && error.message ? error.message : JSON.stringify(error)) }
    console.log(JSON.stringify({ check, wrong }))
  }
}

// Refuse what is not as expected.
exports.same = function (found, expected) {
  if (JSON.stringify(found) !== JSON.stringify(expected)) {
    throw new Error(`${JSON.stringify(found)} is not ${JSON.stringify(expected)}`)
  }
}

// Refuse what is not so.
exports.sure = function (so, found) {
  if (!so) throw new Error(`not as expected: ${JSON.stringify(found)}`)
}

// Wait for what a function gives to its callbacks, 10 s at most.
exports.answer = function (ask) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error('no answer within 10 s')), 10000)
    ask(found => { clearTimeout(timer); resolve(found) }, error => { clearTimeout(timer); reject(error) })
  })
}
