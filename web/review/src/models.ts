// From the server's numbers to three.js objects: the visual mesh, and the convex parts.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  SRGBColorSpace,
  Vector3,
} from "three";
import { toCreasedNormals } from "three/addons/utils/BufferGeometryUtils.js";

import { type Asset, type Counts, getAsset, getGeometry } from "./api";

const CREASE_RAD = 0.6;
const SHINY = /aluminium|brass|chrome|copper|iron|metal|silver|steel/;

/** An asset ready to be shown. Everything is in its object frame, in metres. */
export interface Model {
  asset: Asset;
  visual: Group;
  parts: Group;
  /** Where each part's middle lies from the middle of all. */
  offsets: Vector3[];
  radius: number;
  /** Corners of all parts, x y z. */
  corners: Float32Array;
}

const cache = new Map<string, Promise<Model>>();
const CACHED = 12;

/** The model of an asset's version; the last dozen are kept. */
export function loadModel(hash: string): Promise<Model> {
  const known = cache.get(hash) ?? fetchModel(hash);
  cache.delete(hash);
  cache.set(hash, known);
  known.catch(() => cache.delete(hash));
  for (const old of cache.keys()) {
    if (cache.size <= CACHED) break;
    cache.delete(old);
  }
  return known;
}

async function fetchModel(hash: string): Promise<Model> {
  const [asset, block] = await Promise.all([getAsset(hash), getGeometry(hash)]);
  let offset = 0;
  const next = (counts: Counts): BufferGeometry => {
    const vertices = new Float32Array(block, offset, 3 * counts.vertices);
    const faces = new Uint32Array(block, offset + vertices.byteLength, 3 * counts.faces);
    offset += vertices.byteLength + faces.byteLength;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(vertices, 3));
    geometry.setIndex(new BufferAttribute(faces, 1));
    return geometry;
  };
  const visual = new Group().add(...asset.visual.map((item) => visualMesh(next(item), item.rgba, asset)));
  const hulls = asset.parts.map((part) => next(part));
  const parts = new Group().add(...hulls.map(partMesh));
  const middles = hulls.map(middleOf);
  const middle = middles.reduce((sum, item) => sum.add(item), new Vector3()).divideScalar(Math.max(middles.length, 1));
  const radius = Math.max(...[...visual.children, ...parts.children].map((item) => reach(item as Mesh)), 1e-3);
  return { asset, visual, parts, offsets: middles.map((item) => item.clone().sub(middle)), radius, corners: cornersOf(hulls) };
}

/** Frees what a model holds on the graphics card; it can be shown again. */
export function release(model: Model): void {
  for (const group of [model.visual, model.parts]) {
    group.traverse((item) => {
      if (item instanceof Mesh || item instanceof LineSegments) item.geometry.dispose();
    });
  }
}

function visualMesh(geometry: BufferGeometry, rgba: [number, number, number, number], asset: Asset): Mesh {
  const [red, green, blue, alpha] = rgba;
  const isShiny = SHINY.test(String(asset.attributes.material));
  const material = new MeshStandardMaterial({
    color: new Color().setRGB(red, green, blue, SRGBColorSpace),
    roughness: isShiny ? 0.4 : 0.65,
    metalness: isShiny ? 0.25 : 0,
    opacity: alpha,
    transparent: alpha < 1,
    depthWrite: alpha > 0.5,
  });
  const mesh = new Mesh(toCreasedNormals(geometry, CREASE_RAD), material);
  mesh.castShadow = true;
  mesh.receiveShadow = alpha === 1;
  return mesh;
}

/** Neighbours in the list get hues far apart: each is turned on by the golden angle. */
function partMesh(geometry: BufferGeometry, index: number): Mesh {
  const color = new Color().setHSL((0.52 + index * 0.381966) % 1, 0.6, 0.56 + 0.1 * ((index % 3) - 1));
  const material = new MeshStandardMaterial({ color, roughness: 0.75, flatShading: true });
  const mesh = new Mesh(geometry, material);
  mesh.castShadow = mesh.receiveShadow = true;
  const edges = new LineBasicMaterial({ color: color.clone().multiplyScalar(0.45), transparent: true, opacity: 0.55 });
  return mesh.add(new LineSegments(new EdgesGeometry(geometry, 8), edges)) as Mesh;
}

function middleOf(geometry: BufferGeometry): Vector3 {
  geometry.computeBoundingBox();
  return geometry.boundingBox?.getCenter(new Vector3()) ?? new Vector3();
}

function cornersOf(hulls: BufferGeometry[]): Float32Array {
  return Float32Array.from(hulls.flatMap((hull) => [...hull.getAttribute("position").array]));
}

function reach(mesh: Mesh): number {
  const position = mesh.geometry.getAttribute("position");
  const point = new Vector3();
  let farthest = 0;
  for (let index = 0; index < position.count; index++) {
    farthest = Math.max(farthest, point.fromBufferAttribute(position, index).lengthSq());
  }
  return Math.sqrt(farthest);
}
