// Times of day as people type and read them, in the time zone of the page's server; times are seconds since 1970.
const TYPED = /^\s*(\d{1,2}):(\d{2})(?::(\d{2}))?\s*$/;
const HOW = "write 14:03 or 14:03:20";

// By how much the server's time of day is ahead of UTC [s], as it was told last: a browser may have another zone, and
// the server's events, commands and "silent since" stand on the same page.
let zone = -60 * new Date().getTimezoneOffset();

export function setZone(ahead) {
  zone = ahead;
}

export function clockText(at) {
  return new Date(1000 * (at + zone)).toISOString().slice(11, 19);
}

// A server's date and time of day, in ISO 8601 without a zone.
export function secondsOf(text) {
  return Date.parse(`${text}Z`) / 1000 - zone;
}

// The last moment from first to last that a clock calls so; without seconds the whole minute counts.
// Returns { at }, or { wrong } with a text for people.
export function momentOf(text, first, last) {
  const [, hours, minutes, seconds] = TYPED.exec(text) || [];
  if (hours === undefined || hours > 23 || minutes > 59 || seconds > 59) {
    return { wrong: text.trim() ? `"${text.trim()}" is no time of day: ${HOW}.` : `No time of day: ${HOW}.` };
  }
  const length = seconds === undefined ? 60 : 1;
  const day = 86400;
  const midnight = Math.floor((last + zone) / day) * day - zone;
  for (let begun = midnight; begun + day > first; begun -= day) {
    const begin = begun + 3600 * hours + 60 * minutes + Number(seconds || 0);
    if (begin <= last && begin + length > first) return { at: Math.max(begin, first) };
  }
  return { wrong: `${text.trim()} is outside ${clockText(first)} to ${clockText(last)}.` };
}
