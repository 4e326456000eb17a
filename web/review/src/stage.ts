// The turntable: an asset on the table, its convex parts, its resting orientations.

import {
  ACESFilmicToneMapping,
  DirectionalLight,
  Group,
  HemisphereLight,
  VSMShadowMap,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import type { Pose } from "./api";
import { type Model, release } from "./models";
import { Table } from "./table";

export type View = "whole" | "parts" | "exploded" | "poses";

const TURN_RAD_PER_S = 0.5;
const EXPLOSION = 0.7;
const STEP_BACK = 0.55;
const FASTEST_FRAME_S = 1 / 40;
const SLOW_FRAME_S = 0.12;
const EASE_PER_S = 9;

export class Stage {
  isTurning = true;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(28, 1, 0.005, 50);
  private readonly controls: OrbitControls;
  private readonly light = new DirectionalLight(0xfff4e6, 2.1);
  private readonly table = new Table();
  private readonly turntable = new Group();
  private readonly body = new Group();
  private model: Model | null = null;
  private view: View = "whole";
  private pose: Pose | null = null;
  private spread = 0;
  private reach = 0.1;
  private isStale = true;
  private isCoarse = false;
  private usualFrame = 0;
  private last = performance.now();

  /** Throws if the browser has no WebGL 2. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = VSMShadowMap;
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(1, -1.5, 0.95);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = false;
    this.controls.enableDamping = false;
    this.controls.minPolarAngle = 0.15;
    this.controls.maxPolarAngle = 1.62;
    this.controls.addEventListener("change", () => this.redraw());
    const fill = new DirectionalLight(0xdfe9ff, 0.9);
    fill.position.set(2, -0.6, 1.2);
    const rim = new DirectionalLight(0xffffff, 0.8);
    rim.position.set(-0.6, 2, 1.4);
    this.scene.add(new HemisphereLight(0xf4f8ff, 0x9a948a, 1.5), fill, rim, this.light, this.table, this.turntable);
    this.turntable.add(this.body);
    this.light.castShadow = true;
    this.light.shadow.mapSize.set(1024, 1024);
    this.light.shadow.radius = 6;
    this.light.shadow.blurSamples = 12;
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this.resize();
    this.renderer.setAnimationLoop((now) => this.frame(now));
  }

  /** Show another asset, or none while it loads. */
  show(model: Model | null): void {
    if (this.model && this.model !== model) release(this.model);
    this.body.clear();
    this.model = model;
    if (model) {
      this.body.add(model.visual, model.parts);
      this.pose = uprightPose(model.asset.poses);
      this.spread = 0;
      this.apply(1);
      this.fit(model.radius);
    }
    this.redraw();
  }

  setView(view: View): void {
    this.view = view;
    if (this.model && view !== "poses") this.pose = uprightPose(this.model.asset.poses);
    this.redraw();
  }

  setPose(pose: Pose): void {
    this.pose = pose;
    this.redraw();
  }

  /** The distance between two lines on the table [m]. */
  get gridStep(): number {
    return this.table.step;
  }

  redraw(): void {
    this.isStale = true;
  }

  private fit(radius: number): void {
    this.reach = radius;
    this.table.fit(radius);
    const height = Math.min(this.pose?.height_m ?? radius, radius);
    const away = this.camera.position.clone().sub(this.controls.target).normalize();
    const narrower = Math.min(1, this.camera.aspect);
    const margin = this.canvas.clientHeight < 480 ? 1.4 : 1.12; // room for what lies over the picture
    const distance = (margin * radius) / Math.sin((this.camera.fov * Math.PI) / 360) / narrower;
    this.controls.target.set(0, 0, 0.9 * height);
    this.camera.position.copy(this.controls.target).addScaledVector(away, distance);
    this.camera.near = distance / 50;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = distance / 4;
    this.controls.maxDistance = distance * 3;
    this.controls.update();
    this.light.position.set(-1.6 * radius, -2.2 * radius, 4.2 * radius);
    const { camera } = this.light.shadow;
    camera.left = camera.bottom = -3 * radius;
    camera.right = camera.top = 3 * radius;
    camera.near = radius / 10;
    camera.far = 9 * radius;
    this.light.shadow.bias = -0.0006;
    camera.updateProjectionMatrix();
  }

  private frame(now: number): void {
    const seconds = Math.min((now - this.last) / 1000, 0.25);
    if (seconds < FASTEST_FRAME_S) return;
    this.last = now;
    if (this.model && this.isTurning) this.turntable.rotation.z += TURN_RAD_PER_S * seconds;
    const isMoving = this.apply(1 - Math.exp(-EASE_PER_S * seconds));
    if (!isMoving && !this.isStale && !(this.model && this.isTurning)) return;
    this.isStale = false;
    this.renderer.render(this.scene, this.camera);
    this.keepUp(seconds);
  }

  /** Where pictures come slowly, as without a graphics card, they get fewer pixels. */
  private keepUp(seconds: number): void {
    this.usualFrame = 0.8 * this.usualFrame + 0.2 * seconds;
    if (this.isCoarse || this.usualFrame < SLOW_FRAME_S || !this.isTurning) return;
    this.isCoarse = true;
    this.size();
  }

  /** Move towards what should be shown by a share of the way; tells whether anything moved. */
  private apply(share: number): boolean {
    const { model, pose } = this;
    if (!model || !pose) return false;
    const isApart = this.view === "parts" || this.view === "exploded";
    model.visual.visible = !isApart;
    model.parts.visible = isApart;
    const [w, x, y, z] = pose.quat_wxyz;
    const wanted = new Quaternion(x, y, z, w);
    const spread = this.view === "exploded" ? EXPLOSION : 0;
    const lowest = Math.min(...model.offsets.map((offset) => offset.clone().applyQuaternion(wanted).z), 0);
    const height = pose.height_m - spread * lowest;
    const isMoving =
      this.body.quaternion.angleTo(wanted) > 1e-3 ||
      Math.abs(this.spread - spread) > 1e-3 ||
      Math.abs(this.body.position.z - height) > 1e-5;
    const step = isMoving ? share : 1;
    this.body.quaternion.slerp(wanted, step);
    this.body.position.z += (height - this.body.position.z) * step;
    if (isMoving) this.body.position.z = Math.max(this.body.position.z, heightOnTable(model.corners, this.body.quaternion));
    this.spread += (spread - this.spread) * step;
    model.parts.children.forEach((part, index) => {
      part.position.copy(model.offsets[index] ?? new Vector3()).multiplyScalar(this.spread);
    });
    this.camera.zoom = 1 / (1 + STEP_BACK * this.spread);
    this.camera.updateProjectionMatrix();
    return isMoving;
  }

  private size(): void {
    this.renderer.setPixelRatio(this.isCoarse ? 0.6 : Math.min(devicePixelRatio, 2));
    this.renderer.setSize(this.canvas.clientWidth, this.canvas.clientHeight, false);
    this.redraw();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.size();
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.model) this.fit(this.reach);
    this.redraw();
  }
}


/** Height of the origin at which an object in this orientation touches the table, as it does while it rolls over. */
function heightOnTable(corners: Float32Array, { x, y, z, w }: Quaternion): number {
  const [across, along, up] = [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
  let lowest = Infinity;
  for (let index = 0; index < corners.length; index += 3) {
    const height = across * (corners[index] ?? 0) + along * (corners[index + 1] ?? 0) + up * (corners[index + 2] ?? 0);
    lowest = Math.min(lowest, height);
  }
  return -lowest;
}

/** The pose in which the object's own upward axis points up the most. */
function uprightPose(poses: Pose[]): Pose | null {
  const upward = ({ quat_wxyz: [, x, y] }: Pose): number => 1 - 2 * (x * x + y * y);
  return poses.reduce<Pose | null>((best, pose) => (best && upward(best) >= upward(pose) - 1e-3 ? best : pose), null);
}
