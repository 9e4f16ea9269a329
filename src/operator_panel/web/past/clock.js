// Times of day as people type and read them, in the browser's own time zone; times are seconds since 1970.
const TYPED = /^\s*(\d{1,2}):(\d{2})(?::(\d{2}))?\s*$/;
const HOW = "write 14:03 or 14:03:20";

export function clockText(at) {
  return new Date(1000 * at).toLocaleTimeString("en-GB", { hourCycle: "h23" });
}

// The last moment from first to last that a clock calls so; without seconds the whole minute counts.
// Returns { at }, or { wrong } with a text for people.
export function momentOf(text, first, last) {
  const [, hours, minutes, seconds] = TYPED.exec(text) || [];
  if (hours === undefined || hours > 23 || minutes > 59 || seconds > 59) {
    return { wrong: text.trim() ? `"${text.trim()}" is no time of day: ${HOW}.` : `No time of day: ${HOW}.` };
  }
  const length = seconds === undefined ? 60 : 1;
  const day = new Date(1000 * last);
  day.setHours(0, 0, 0, 0);
  for (; day.getTime() / 1000 + 90000 > first; day.setDate(day.getDate() - 1)) { // a day has up to 25 hours
    const begin = new Date(day).setHours(hours, minutes, seconds || 0) / 1000;
    if (begin <= last && begin + length > first) return { at: Math.max(begin, first) };
  }
  return { wrong: `${text.trim()} is outside ${clockText(first)} to ${clockText(last)}.` };
}
