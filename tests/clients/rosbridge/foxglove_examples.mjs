// Foxglove Studio's rosbridge player, unmodified. Usage: foxglove_examples.mjs PORT NAMESPACE; prints one line of
// JSON for each check, see checks.js. The test's own nodes are below NAMESPACE: see ros_side.py.
import checks from './checks.js'
import { RosbridgePlayer, NoopMetricsCollector, roslib } from './foxglove_player.mjs'

const { run, same, sure, answer } = checks
const [port, namespace] = process.argv.slice(2)
const url = `ws://127.0.0.1:${port}`
const name = relative => `${namespace}/${relative}`

const player = new RosbridgePlayer({ url, metricsCollector: new NoopMetricsCollector(), sourceId: 'rosbridge-websocket' })
const messages = []
let waiting = []
player.setListener(async state => {
  messages.push(...(state.activeData?.messages ?? []))
  waiting = waiting.filter(such => !such(state))
})
// Wait for a state of the player's that has what is asked for.
const until = such => answer(good => waiting.push(state => {
  const found = such(state)
  if (found) good(found)
  return found
}))
const heard = topic => until(() => messages.find(one => one.topic === name(topic)))

await run('@foxglove/studio-base', {
  connect: async () => { same(await until(({ presence, profile }) => presence === 'PRESENT' && profile), 'ros1') },
  'questions about topics': async () => {
    const data = await until(({ activeData }) => activeData)
    const states = data.topics.find(topic => topic.name === name('states'))
    same(states.schemaName, 'sensor_msgs/JointState')
    const fields = data.datatypes.get('sensor_msgs/JointState').definitions.map(field => field.name)
    same(fields, ['header', 'name', 'position', 'velocity', 'effort'])
    same(data.topics.filter(topic => !data.datatypes.has(topic.schemaName)), [])
  },
  'listen, as cbor-raw': async () => {
    const topics = (await until(({ activeData }) => activeData)).topics
    player.setSubscriptions(topics.map(({ name }) => ({ topic: name })))
    const { message } = await heard('states')
    same([message.name, Array.from(message.position)], [['joint_1'], [0.5]])
    const image = (await heard('image')).message
    same([image.width, image.encoding, Array.from(image.data)], [2, 'rgb8', Array.from({ length: 12 }, (_, k) => k)])
  },
  'publish right after advertise': async () => {
    player.setPublishers([{ topic: name('question'), schemaName: 'std_msgs/String' }])
    player.publish({ topic: name('question'), msg: { data: 'hello' } })
    same((await heard('answer')).message.data, 'hello')
  },
  'call a service': async () => { same(await player.callService(name('switch'), { data: true }), { success: true, message: 'on' }) },
  'questions about nodes': async () => {
    const { publishedTopics, services } = await until(({ activeData }) =>
      activeData?.services.has(name('switch')) && activeData)
    same(publishedTopics.get(name('states')).size, 1)
    same(services.get(name('switch')).size, 1)
  },
  parameters: async () => { // the player has none; the library that it speaks with has
    const ros = new roslib.Ros({ url, transportLibrary: 'workersocket' })
    await answer((good, bad) => { ros.on('connection', good); ros.on('error', bad) })
    const gains = new roslib.Param({ ros, name: name('gains') })
    await answer(good => gains.set(1.5, good))
    same(await answer(good => gains.get(good)), 1.5)
    sure((await answer((good, bad) => ros.getParams(good, bad))).includes(name('gains')))
    await answer(good => gains.delete(good))
  },
  'no problem is shown': async () => { same(await until(({ problems }) => problems), []) }
})
player.close()
process.exit(0)
