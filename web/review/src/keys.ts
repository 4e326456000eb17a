// What keys do, and the help that says so.

import { byId, h } from "./dom";

export interface Key {
  key: string;
  also?: string[];
  does: string;
  mayRepeat?: boolean;
  run: () => unknown;
}

const SHOWN: Record<string, string> = { ArrowLeft: "←", ArrowRight: "→", " ": "Space" };

/** The name of a key, whether or not Shift or Caps Lock is on. */
export const keyName = (event: KeyboardEvent): string => (event.key.length === 1 ? event.key.toLowerCase() : event.key);

export function fillHelp(keys: readonly Key[]): void {
  byId("keys").replaceChildren(
    ...keys.map(({ key, also, does }) =>
      h(
        "div",
        {},
        h("dt", {}, ...[key, ...(also ?? [])].map((name) => h("kbd", {}, SHOWN[name] ?? name.toUpperCase()))),
        h("dd", {}, does),
      ),
    ),
  );
}
