// Foxglove Studio's player for rosbridge, as it is in the package @foxglove/studio-base, under Node.js.
// The package is made for a build with webpack in a browser. So the hooks find its modules, and two things
// that browsers have are here: a Worker, and a web socket in it.
import { register } from 'node:module'
import { resolveObjectURL } from 'node:buffer'
import { Worker as Thread } from 'node:worker_threads'

register('./foxglove_hooks.mjs', import.meta.url)

// What a browser's worker has, in front of the code that the player gives it.
const PRELUDE = `
const { parentPort } = require('node:worker_threads')
globalThis.self = globalThis
self.WebSocket ??= require('ws')
self.postMessage = data => parentPort.postMessage(data)
self.addEventListener = (_, take) => parentPort.on('message', data => take({ data }));
`

globalThis.window = globalThis
globalThis.__dirname = ''
globalThis.Worker = class {
  constructor (url) {
    this.thread = resolveObjectURL(url).text().then(code => new Thread(PRELUDE + code, { eval: true }))
  }

  addEventListener (_, take) {
    this.thread.then(thread => thread.on('message', data => take({ data })))
  }

  postMessage (data) {
    this.thread.then(thread => thread.postMessage(data))
  }

  terminate () {
    this.thread.then(thread => thread.terminate())
  }
}

export const { default: roslib } = await import('@foxglove/roslibjs') // what the player speaks with
const folder = '@foxglove/studio-base/src/players/'
export const { default: RosbridgePlayer } = await import(folder + 'RosbridgePlayer.js')
export const { default: NoopMetricsCollector } = await import(folder + 'NoopMetricsCollector.js')
