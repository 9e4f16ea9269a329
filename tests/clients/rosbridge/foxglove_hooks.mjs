// How Node.js finds what Foxglove's own build finds for its player: see foxglove_player.mjs.
const HERE = new URL('./foxglove_workspace.mjs', import.meta.url).href
const UNPUBLISHED = ['@foxglove/den/async', '@foxglove/den/collection', '@foxglove/log']
const PLAYERS = '/@foxglove/studio-base/src/'

export async function resolve (specifier, context, next) {
  if (UNPUBLISHED.includes(specifier)) return { url: HERE, shortCircuit: true }
  if (specifier === 'lodash') return next('lodash-es', context) // the same, as modules
  if (specifier.startsWith('.') && context.parentURL.includes(PLAYERS)) return next(specifier + '.js', context)
  return next(specifier, context)
}

export function load (url, context, next) {
  return next(url, url.includes(PLAYERS) ? { ...context, format: 'module' } : context)
}
