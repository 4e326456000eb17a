// What the server says, and how it is asked. All addresses are relative to the page's secret path.

export type Verdict = "accept" | "edit" | "reject";
export type Field = "category" | "colour" | "material" | "mass_kg" | "friction";
export type Change = Partial<Record<Field, string | number>>;

export interface Row {
  name: string;
  hash: string;
  category: string;
  decision: Verdict | null;
  who: string;
  when: string;
  reason: string;
}

export interface Undoable {
  entry_id: string;
  decision: Verdict;
  asset_name: string;
}

export interface Overview {
  library: string;
  reviewer: string;
  limits: { mass_kg: number; friction: number; word: number; reason: number };
  materials: string[];
  assets: Row[];
  undoable: Undoable | null;
}

export interface Counts {
  vertices: number;
  faces: number;
}

export interface Pose {
  quat_wxyz: [number, number, number, number];
  height_m: number;
  probability: number;
}

export interface Asset {
  name: string;
  hash: string;
  size_class: string | null;
  extents_m: [number, number, number];
  mass_kg: number;
  attributes: Record<string, string | number>;
  licence: { name: string; author: string; source: string; source_id: string; url: string };
  quality: {
    source_vertices: number;
    source_watertight: boolean;
    volume_ratio: number;
    hull_volume_ratio: number;
    hausdorff_m: number;
    stable_candidates: number;
    stable_verified: number;
    seconds: number;
    fallbacks: string[];
  };
  symmetry: { rotations: number; has_axis: boolean };
  poses: Pose[];
  visual: (Counts & { rgba: [number, number, number, number] })[];
  parts: Counts[];
}

export interface Decided {
  entry_id: string;
  asset: Row;
  undoable: Undoable | null;
}

/** The server refused; its message is one line for the reviewer. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    message: string,
  ) {
    super(message);
  }
}

/** The server cannot be reached. */
export class Unreachable extends Error {}

export const getOverview = (): Promise<Overview> => json("api/assets");
export const getAsset = (hash: string): Promise<Asset> => json(`api/assets/${hash}`);
export const getGeometry = async (hash: string): Promise<ArrayBuffer> =>
  (await request(`api/assets/${hash}/geometry`)).arrayBuffer();
export const postDecision = (body: {
  asset_hash: string;
  decision: Verdict;
  change?: Change;
  reason?: string;
}): Promise<Decided> => json("api/decisions", body);
export const postUndo = (entryId: string): Promise<Decided> => json("api/undo", { entry_id: entryId });

async function json<T>(path: string, body?: object): Promise<T> {
  return (await request(path, body)).json() as Promise<T>;
}

async function request(path: string, body?: object): Promise<Response> {
  const options: RequestInit = body
    ? { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }
    : {};
  let response: Response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Unreachable("the server does not answer");
  }
  if (response.ok) return response;
  const { error } = (await response.json().catch(() => ({ error: response.statusText }))) as { error: string };
  throw new Refused(response.status, error);
}
