// The list of assets, with what was decided of each; it can be searched and filtered.

import type { Row, Verdict } from "./api";
import { byId, h } from "./dom";

type Filter = "all" | "open" | Verdict;
const FILTERS: [Filter, string][] = [
  ["all", "All"],
  ["open", "Open"],
  ["accept", "Accepted"],
  ["edit", "Edited"],
  ["reject", "Rejected"],
];
const STATES: Record<string, string> = { accept: "accepted", edit: "edited", reject: "rejected", open: "open" };

const isIn = (row: Row, filter: Filter): boolean => filter === "all" || (row.decision ?? "open") === filter;

export class AssetList {
  private rows: Row[] = [];
  private current: string | null = null;
  private filter: Filter = "all";
  private readonly items = byId("rows");
  private readonly search = byId<HTMLInputElement>("search");

  constructor(private readonly onOpen: (row: Row) => void) {
    this.search.addEventListener("input", () => this.draw());
    this.search.addEventListener("keydown", (event) => {
      const first = this.shown()[0];
      if (event.key === "Enter" && first) this.onOpen(first);
      if (event.key === "Escape") this.search.value = "";
      if (event.key === "Enter" || event.key === "Escape") {
        this.search.blur();
        this.draw();
      }
    });
    this.items.addEventListener("click", (event) => {
      const name = (event.target as HTMLElement).closest("button")?.dataset.name;
      const row = this.rows.find((item) => item.name === name);
      if (row) this.onOpen(row);
    });
  }

  show(rows: Row[], current: string | null): void {
    [this.rows, this.current] = [rows, current];
    this.draw();
  }

  mark(name: string): void {
    this.current = name;
    for (const button of this.items.querySelectorAll<HTMLElement>("button")) markButton(button, name);
    this.items.querySelector("[aria-current]")?.parentElement?.scrollIntoView({ block: "nearest" });
    byId("list").classList.remove("shown");
    byId("list-toggle").setAttribute("aria-expanded", "false");
  }

  find(): void {
    byId("list").classList.add("shown");
    this.search.focus();
    this.search.select();
  }

  toggle(): void {
    const isShown = byId("list").classList.toggle("shown");
    byId("list-toggle").setAttribute("aria-expanded", String(isShown));
  }

  /** The asset so many places on among those that are shown. */
  neighbour(name: string | null, by: number): Row | undefined {
    const shown = this.shown();
    const index = shown.findIndex((row) => row.name === name);
    return shown[index < 0 ? 0 : index + by];
  }

  /** What is likely looked at next. */
  after(name: string, count: number): Row[] {
    const index = this.rows.findIndex((row) => row.name === name);
    const rest = this.rows.slice(index + 1);
    return [...new Set([...rest.slice(0, 1), ...rest.filter((row) => !row.decision).slice(0, count)])];
  }

  private shown(): Row[] {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const fits = (row: Row): boolean => words.every((word) => `${row.name} ${row.category}`.toLowerCase().includes(word));
    return this.rows.filter((row) => isIn(row, this.filter) && fits(row));
  }

  private draw(): void {
    const shown = this.shown();
    this.items.replaceChildren(...shown.map((row) => this.item(row)));
    byId("no-rows").hidden = shown.length > 0;
    byId("filters").replaceChildren(
      ...FILTERS.map(([filter, text]) => {
        const count = this.rows.filter((row) => isIn(row, filter)).length;
        const pick = (): void => {
          this.filter = filter;
          this.draw();
          byId("filters").querySelector<HTMLElement>(`[data-filter=${filter}]`)?.focus();
        };
        const attributes = { type: "button", "data-filter": filter, "aria-pressed": String(filter === this.filter), onclick: pick };
        return h("button", attributes, text, " ", h("span", {}, String(count)));
      }),
    );
    this.items.querySelector("[aria-current]")?.parentElement?.scrollIntoView({ block: "nearest" });
  }

  private item(row: Row): HTMLElement {
    const state = row.decision ?? "open";
    const button = h(
      "button",
      { type: "button", "data-name": row.name, class: `row ${state}` },
      h("i", { "aria-hidden": "true" }),
      h("span", { class: "name" }, row.name),
      h("span", { class: "sr-only" }, `, ${STATES[state] ?? state}`),
    );
    markButton(button, this.current);
    return h("li", {}, button);
  }
}

function markButton(button: HTMLElement, name: string | null): void {
  if (button.dataset.name === name) button.setAttribute("aria-current", "true");
  else button.removeAttribute("aria-current");
}
