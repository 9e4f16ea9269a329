// Stand-ins for three helpers of Foxglove Studio's source tree that are in no package of theirs.

// Run an asynchronous function at most once at a time; calls meanwhile are one more run.
export function debouncePromise (act) {
  let running = false
  let again = false
  return async function run () {
    again = true
    if (running) return
    running = true
    while (again) {
      again = false
      await act()
    }
    running = false
  }
}

// Map, and leave out what is undefined.
export function filterMap (list, act) {
  return list.map(act).filter(value => value !== undefined)
}

const nothing = () => {}
export default { getLogger: () => ({ debug: nothing, info: nothing, warn: console.error, error: console.error }) }
