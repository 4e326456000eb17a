// What is known of an asset, and the form that changes it.

import type { Asset, Change, Field, Row } from "./api";
import { byId, h } from "./dom";
import { count, millimetres, moment, noteText, number, originText, percent, sides } from "./format";

interface FieldSpec {
  field: Field;
  label: string;
  unit?: string;
}
const FIELDS: FieldSpec[] = [
  { field: "category", label: "Category" },
  { field: "colour", label: "Colour" },
  { field: "material", label: "Material" },
  { field: "mass_kg", label: "Mass", unit: "kg" },
  { field: "friction", label: "Friction" },
];
const VERDICTS = { accept: "Accepted", edit: "Edited", reject: "Rejected" };

export class Details {
  private readonly pane = byId("details");
  private readonly materials = h("datalist", { id: "materials" });
  private asset: Asset | null = null;
  private row: Row | null = null;
  private isEditing = false;

  constructor(private readonly onEdit: (change: Change) => void) {
    document.body.append(this.materials);
  }

  setMaterials(names: string[]): void {
    this.materials.replaceChildren(...names.map((value) => h("option", { value })));
  }

  show(asset: Asset, row: Row): void {
    if (this.isEditing && this.asset?.hash === asset.hash) return;
    [this.asset, this.row, this.isEditing] = [asset, row, false];
    this.draw();
    this.pane.scrollTop = 0;
  }

  edit(): void {
    if (!this.asset) return;
    this.isEditing = true;
    this.draw();
    this.pane.querySelector<HTMLInputElement>("form input")?.select();
  }

  private draw(): void {
    const { asset, row } = this;
    if (!asset || !row) return;
    this.pane.replaceChildren(
      heading(asset, row),
      this.isEditing ? this.form(asset) : attributes(asset),
      notes(asset),
      facts("Shape", shapeFacts(asset)),
      facts("Origin", originFacts(asset)),
    );
  }

  private form(asset: Asset): HTMLElement {
    const inputs = new Map<Field, HTMLInputElement>();
    const lines = FIELDS.map(({ field, label, unit }) => {
      const isNumber = field === "mass_kg" || field === "friction";
      const input = h("input", {
        name: field,
        id: `edit-${field}`,
        value: String(valueOf(asset, field)),
        autocomplete: "off",
        required: true,
        inputmode: isNumber ? "decimal" : "text",
        list: field === "material" ? "materials" : false,
        pattern: isNumber ? "[0-9]*[.,]?[0-9]+([eE][\\-+]?[0-9]+)?" : false,
        title: isNumber ? "a number above 0" : false,
      });
      inputs.set(field, input);
      return h("div", {}, h("label", { for: input.id }, unit ? `${label} [${unit}]` : label), input);
    });
    const close = (): void => {
      this.isEditing = false;
      this.draw();
      byId("edit").focus();
    };
    const submit = (event: Event): void => {
      event.preventDefault();
      const change = changed(asset, inputs);
      close();
      if (Object.keys(change).length) this.onEdit(change);
    };
    const cancelOnEscape = (event: Event): void => void ((event as KeyboardEvent).key === "Escape" && close());
    return h(
      "form",
      { class: "edit", "aria-label": `Values of ${asset.name}`, onsubmit: submit, onkeydown: cancelOnEscape },
      ...lines,
      h(
        "div",
        { class: "row" },
        h("button", { type: "submit", class: "act edit" }, "Save ", h("kbd", {}, "Enter")),
        h("button", { type: "button", class: "ghost", onclick: close }, "Cancel ", h("kbd", {}, "Esc")),
      ),
    );
  }
}

function changed(asset: Asset, inputs: Map<Field, HTMLInputElement>): Change {
  const change: Change = {};
  for (const [field, input] of inputs) {
    const before = valueOf(asset, field);
    const after = typeof before === "number" ? Number(input.value.replace(",", ".")) : input.value.trim();
    if (after !== before) change[field] = after;
  }
  return change;
}

const valueOf = (asset: Asset, field: Field): string | number =>
  field === "mass_kg" ? asset.mass_kg : (asset.attributes[field] ?? "");

const originOf = (asset: Asset, field: Field): string => String(asset.attributes[`${field.replace("_kg", "")}_from`] ?? "");

function heading(asset: Asset, row: Row): HTMLElement {
  const state = row.decision ?? "open";
  const decision = row.decision ? `${VERDICTS[row.decision]} by ${row.who}` : "Not reviewed";
  const lines: HTMLElement[] = [h("h1", {}, asset.name), h("p", { class: `badge ${state}` }, h("i", {}), decision)];
  if (row.when) lines.push(h("p", { class: "quiet" }, row.reason ? `${moment(row.when)} · ${row.reason}` : moment(row.when)));
  return h("header", {}, ...lines);
}

function attributes(asset: Asset): HTMLElement {
  const lines = FIELDS.map(({ field, label, unit }) => {
    const value = valueOf(asset, field);
    const text = typeof value === "number" ? number(value) : value;
    const origin = originOf(asset, field);
    return h(
      "div",
      { "data-field": field },
      h("dt", {}, label),
      h("dd", {}, h("span", { class: "value" }, unit ? `${text} ${unit}` : text), h("span", { class: `from ${origin}`, title: originText(origin) }, origin)),
    );
  });
  return h("section", {}, h("h2", {}, "Attributes", h("span", { class: "aside" }, "from")), h("dl", { class: "attributes" }, ...lines));
}

function notes(asset: Asset): HTMLElement {
  const { fallbacks } = asset.quality;
  if (!fallbacks.length) return h("p", { class: "notes clean" }, "Processing went the normal way.");
  return h(
    "ul",
    { class: "notes", "aria-label": "What did not go the normal way" },
    ...fallbacks.map((code) => h("li", { title: code, class: code.endsWith("out-of-tolerance") ? "severe" : "" }, noteText(code))),
  );
}

function facts(title: string, rows: [string, string][]): HTMLElement {
  return h(
    "section",
    {},
    h("h2", {}, title),
    h("dl", {}, ...rows.filter(([, value]) => value).map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))),
  );
}

function shapeFacts(asset: Asset): [string, string][] {
  const { quality, symmetry } = asset;
  const longest = Math.max(...asset.extents_m);
  const spins = symmetry.has_axis ? "about an axis" : count(symmetry.rotations, "rotation");
  return [
    ["Size", sides(asset.extents_m)],
    ["Class", asset.size_class ?? "neither small nor large"],
    ["Convex parts", `${number(asset.parts.length)}, ${number(asset.parts.reduce((sum, part) => sum + part.vertices, 0))} vertices`],
    ["Poses that held", `${quality.stable_verified} of ${quality.stable_candidates}`],
    ["Symmetry", symmetry.rotations === 1 && !symmetry.has_axis ? "none" : spins],
    ["Parts / mesh volume", percent(quality.volume_ratio)],
    ["Parts off the mesh", `${millimetres(quality.hausdorff_m)} mm (${percent(quality.hausdorff_m / longest)})`],
    ["Source mesh", `${number(quality.source_vertices)} vertices, ${quality.source_watertight ? "closed" : "not closed"}`],
  ];
}

function originFacts(asset: Asset): [string, string][] {
  const { licence } = asset;
  return [
    ["Licence", licence.name],
    ["Author", licence.author],
    ["Source", licence.source],
    ["Object", licence.source_id],
    ["Address", licence.url],
    ["Hash", asset.hash.slice(0, 12)],
  ];
}
