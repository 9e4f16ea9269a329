// Who has which configuration: changes that were rolled out, and the cells' own files last.
import { byId, make, put } from "./parts.js";

const MOST_NAMES = 12;

export function showConfigurations(groups) {
  const list = byId("configurations");
  while (list.children.length > groups.length) list.lastElementChild.remove();
  while (list.children.length < groups.length) list.append(make("li", ""));
  groups.forEach((group, k) => {
    const more = group.cells.length - MOST_NAMES;
    const names = group.cells.slice(0, MOST_NAMES).join(", ") + (more > 0 ? ` and ${more} more` : "");
    put(list.children[k], `${group.text}: ${names}`);
  });
}
