// Numbers and codes as a reader wants them.

const NOTES: Record<string, string> = {
  "solid:wrapped": "The mesh was not closed; its surface was wrapped.",
  "solid:gaps-closed": "Gaps were closed before wrapping.",
  "solid:from-parts": "The solid was made from the given parts.",
  "decomposition:out-of-tolerance": "The convex parts are out of tolerance: compare them with the mesh.",
  "decomposition:finer": "The parts were done again with a finer search.",
  "decomposition:better-as-hull": "One convex hull fitted better than parts.",
  "decomposition:hull": "Decomposition failed: the part is the convex hull.",
  "parts:given-not-convex-or-too-many": "The given parts could not be used and were made anew.",
  "mass:from-parts": "Mass was distributed over the parts, not the solid.",
  "stable-poses:random-drops": "Poses were found by random drops.",
  "stable-poses:hull-centre": "The centre of mass lay outside; the hull's was taken.",
  "stable-poses:none-proposed": "Geometry proposed no resting pose.",
};
const ORIGINS: Record<string, string> = {
  source: "stated by the source",
  rule: "by rule",
  declared: "declared by the family's author",
  vlm: "by a vision-language model",
  person: "by a person",
};

export const noteText = (code: string): string => NOTES[code] ?? code;
export const originText = (origin: string): string => ORIGINS[origin] ?? origin;
export const centimetres = (metres: number): string => (100 * metres).toFixed(1);
export const millimetres = (metres: number): string => (1000 * metres).toFixed(1);
export const percent = (share: number): string => (share > 0 && share < 0.01 ? "<1%" : `${Math.round(100 * share)}%`);
export const number = (value: number): string => value.toLocaleString("en", { maximumSignificantDigits: 4 });
export const sides = (extents: number[]): string => `${extents.map(centimetres).join(" × ")} cm`;

/** "3 poses", "1 pose". */
export const count = (items: number, one: string): string => `${number(items)} ${one}${items === 1 ? "" : "s"}`;

/** A moment in the reader's own time. */
export function moment(iso: string): string {
  return new Date(iso).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}
