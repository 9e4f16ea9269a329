// What roslibjs' documentation shows, by roslibjs alone. Usage: roslibjs_examples.mjs PORT NAMESPACE; prints one
// line of JSON for each check, see checks.js. The test's own nodes are below NAMESPACE: see ros_side.py.
import * as loaded from 'roslib'
import checks from './checks.js'

const { run, same, sure, answer } = checks
const ROSLIB = loaded.Ros ? loaded : loaded.default // 1.4 is a CommonJS module
const [port, namespace] = process.argv.slice(2)
const name = relative => `${namespace}/${relative}`
// Version 1 has classes for what is plain objects in version 2.
const message = fields => ROSLIB.Message ? new ROSLIB.Message(fields) : fields
const request = fields => ROSLIB.ServiceRequest ? new ROSLIB.ServiceRequest(fields) : fields

const ros = new ROSLIB.Ros()
const ask = (method, ...args) => answer((good, bad) => ros[method](...args, good, bad))
const topic = (relative, messageType, more = {}) => new ROSLIB.Topic({ ros, name: name(relative), messageType, ...more })
const service = (relative, serviceType = 'std_srvs/SetBool') =>
  new ROSLIB.Service({ ros, name: relative.startsWith('/') ? relative : name(relative), serviceType })
const call = (one, fields) => answer((good, bad) => one.callService(request(fields), good, bad))
const time = async () => (await call(service('/rosapi/get_time', 'rosapi/GetTime'), {})).time

// Subscribe, and give the promise of the first message.
async function first (heard) {
  const promise = answer(good => heard.subscribe(good)).finally(() => heard.unsubscribe())
  promise.catch(() => {})
  await time() // the subscription is made
  return { promise }
}

async function told (relative, text) {
  const teller = topic(relative, 'std_msgs/String')
  teller.publish(message({ data: text }))
  return teller
}

// Offer a service whose handler returns this, and have it called by a node.
async function lamp (returned, expected) {
  const offered = service('lamp')
  offered.advertise((asked, response) => {
    Object.assign(response, { success: asked.data, message: 'lit' })
    return returned
  })
  const outcome = `lamp_used_${returned}`
  const used = await first(topic(outcome, 'std_msgs/String'))
  const teller = await told('use_lamp', outcome)
  const { data } = await used.promise
  sure(data.startsWith(expected), data)
  teller.unadvertise()
  offered.unadvertise()
  await time()
}

async function listen (compression) {
  const states = topic('states', 'sensor_msgs/JointState', compression ? { compression } : {})
  const heard = await (await first(states)).promise
  same([heard.name, Array.from(heard.position)], [['joint_1'], [0.5]])
}

async function count (server, goal) {
  const actionClient = new ROSLIB.ActionClient({ ros, serverName: name(server), actionName: 'actionlib/TestAction' })
  const wanted = new ROSLIB.Goal({ actionClient, goalMessage: { goal } })
  // Two topics: nobody promises which of them comes first.
  const feedback = answer(good => wanted.on('feedback', good))
  const result = answer(good => wanted.on('result', good))
  wanted.send()
  const [step, found] = await Promise.all([feedback, result])
  same([step.feedback, found.result], [1, goal])
  actionClient.dispose()
}

await run('roslib', {
  connect: () => answer((good, bad) => {
    ros.on('connection', good)
    ros.on('error', bad)
    ros.connect(`ws://127.0.0.1:${port}`)
  }),
  'listen to a topic': () => listen(),
  'listen, compressed as png': () => listen('png'),
  'listen, compressed as cbor': () => listen('cbor'),
  'publish right after advertise': async () => {
    const answers = await first(topic('answer', 'std_msgs/String'))
    const question = await told('question', 'hello')
    same((await answers.promise).data, 'hello')
    question.unadvertise()
  },
  'header without a stamp': async () => {
    const stamps = await first(topic('stamped', 'std_msgs/Header'))
    const teller = topic('stamped', 'std_msgs/Header')
    teller.publish(message({ frame_id: 'base_link' }))
    const { stamp } = await stamps.promise
    const now = await time()
    sure(Math.abs(stamp.secs - now.secs) <= 5, [stamp, now])
    teller.unadvertise()
  },
  'call a service': async () => {
    const found = await call(service('switch'), { data: true })
    same([found.success, found.message], [true, 'on'])
  },
  'offer a service': () => lamp(true, 'True lit'),
  // Version 2 keeps back what its handler has said.
  'offer a service whose handler returns false': () => lamp(false, ROSLIB.Message ? 'True lit' : 'failed'),
  parameters: async () => {
    const gains = new ROSLIB.Param({ ros, name: name('gains') })
    await answer((good, bad) => gains.set({ p: 1.5, joints: ['joint_1'] }, good, bad))
    same(await answer((good, bad) => gains.get(good, bad)), { p: 1.5, joints: ['joint_1'] })
    sure((await ask('getParams')).includes(name('gains/p')))
    await answer((good, bad) => gains.delete(good, bad))
    same(await answer((good, bad) => gains.get(good, bad)), null)
  },
  'questions about topics': async () => {
    const { topics, types } = await ask('getTopics')
    same(types[topics.indexOf(name('states'))], 'sensor_msgs/JointState')
    same(await ask('getTopicType', name('states')), 'sensor_msgs/JointState')
    sure((await ask('getTopicsForType', 'sensor_msgs/JointState')).includes(name('states')))
    const raw = await ask('getTopicsAndRawTypes')
    sure(raw.typedefs_full_text[raw.topics.indexOf(name('states'))].includes('float64[] position'))
  },
  'questions about services': async () => {
    sure((await ask('getServices')).includes(name('switch')))
    same(await ask('getServiceType', name('switch')), 'std_srvs/SetBool')
    sure((await ask('getServicesForType', 'std_srvs/SetBool')).includes(name('switch')))
  },
  'questions about nodes': async () => {
    const details = await Promise.all((await ask('getNodes')).map(node => answer((good, bad) =>
      ros.getNodeDetails(node, (found, publishing) => good(publishing ?? found.publishing), bad))))
    sure(details.some(publishing => publishing.includes(name('states'))), details)
  },
  'questions about types': async () => {
    const defs = await ask('getMessageDetails', 'sensor_msgs/JointState')
    same(defs[0].fieldnames[0], 'header')
    same(ros.decodeTypeDefs(defs).header.stamp, 'time')
    same((await ask('getServiceRequestDetails', 'std_srvs/SetBool')).typedefs[0].fieldnames, ['data'])
    same((await ask('getServiceResponseDetails', 'std_srvs/SetBool')).typedefs[0].fieldnames, ['success', 'message'])
  },
  'action servers': async () => { sure((await ask('getActionServers')).includes(name('count'))) },
  'send an action goal': () => count('count', 3),
  'offer an action': async () => {
    const server = new ROSLIB.SimpleActionServer({ ros, serverName: name('double'), actionName: 'actionlib/TestAction' })
    server.on('goal', ({ goal }) => {
      server.sendFeedback({ feedback: 1 })
      server.setSucceeded({ result: goal })
    })
    await count('double', 2)
  },
  'refused call raises': async () => {
    const error = await call(service('nowhere'), { data: true }).then(() => 'no error', String)
    sure(error.includes('nowhere'), error)
  },
  'think between two calls': async () => {
    await time()
    await new Promise(resolve => setTimeout(resolve, 1500))
    await time()
  }
})
process.exit(0)
