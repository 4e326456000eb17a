// What the stage shows of an asset, and the controls over it.

import { byId, h } from "./dom";
import { centimetres, count, percent, sides } from "./format";
import type { Key } from "./keys";
import type { Model } from "./models";
import { Stage, type View } from "./stage";

const VIEWS: [View, string][] = [
  ["whole", "Whole"],
  ["parts", "Parts"],
  ["exploded", "Exploded"],
  ["poses", "Poses"],
];

export class Viewer {
  readonly keys: Key[] = [
    ...VIEWS.map(([view, text], index) => ({ key: String(index + 1), does: `View: ${text.toLowerCase()}`, run: () => this.setView(view) })),
    { key: "[", does: "Previous pose", mayRepeat: true, run: () => this.stepPose(-1) },
    { key: "]", does: "Next pose", mayRepeat: true, run: () => this.stepPose(1) },
    { key: " ", does: "Turn, or stand still", run: () => this.setTurning(!this.isTurning) },
  ];
  private readonly stage: Stage | null;
  private model: Model | null = null;
  private view: View = "whole";
  private pose = 0;
  private isTurning = !matchMedia("(prefers-reduced-motion: reduce)").matches;

  constructor() {
    this.stage = makeStage();
    byId("views").replaceChildren(
      ...VIEWS.map(([view, text], index) =>
        h("button", { type: "button", "data-view": view, "aria-keyshortcuts": index + 1, onclick: () => this.setView(view) }, text, " ", h("kbd", {}, String(index + 1))),
      ),
    );
    byId("pose-previous").addEventListener("click", () => this.stepPose(-1));
    byId("pose-next").addEventListener("click", () => this.stepPose(1));
    byId("turn").addEventListener("click", () => this.setTurning(!this.isTurning));
    this.setTurning(this.isTurning);
  }

  show(model: Model): void {
    this.model = model;
    this.pose = 0;
    this.stage?.show(model);
    this.draw();
  }

  private setView(view: View): void {
    this.view = view;
    this.stage?.setView(view);
    this.showPose();
    this.draw();
  }

  private stepPose(by: number): void {
    const poses = this.model?.asset.poses.length ?? 0;
    if (!poses) return;
    if (this.view === "poses") this.pose = (this.pose + by + poses) % poses;
    this.setView("poses");
  }

  private showPose(): void {
    const pose = this.model?.asset.poses[this.pose];
    if (pose && this.view === "poses") this.stage?.setPose(pose);
  }

  private setTurning(isTurning: boolean): void {
    this.isTurning = isTurning;
    if (this.stage) this.stage.isTurning = isTurning;
    const button = byId("turn");
    button.setAttribute("aria-pressed", String(isTurning));
    button.replaceChildren("Turn ", h("kbd", {}, "Space"));
  }

  private draw(): void {
    for (const button of byId("views").querySelectorAll<HTMLElement>("button")) {
      button.setAttribute("aria-pressed", String(button.dataset.view === this.view));
    }
    byId("poses").hidden = this.view !== "poses";
    if (!this.model) return;
    const { asset } = this.model;
    const texts: Record<View, string> = {
      whole: sides(asset.extents_m),
      parts: count(asset.parts.length, "convex part"),
      exploded: count(asset.parts.length, "convex part"),
      poses: `Pose ${this.pose + 1} of ${asset.poses.length} · ${percent(asset.poses[this.pose]?.probability ?? 0)} of drops`,
    };
    const grid = this.stage ? `  ·  grid ${Number(centimetres(this.stage.gridStep))} cm` : "";
    byId("caption").textContent = texts[this.view] + (this.view === "whole" ? grid : "");
    byId("canvas").setAttribute("aria-label", `${asset.name}: ${texts[this.view]}`);
    this.drawBars();
  }

  /** One bar a pose, as high as the pose is probable. */
  private drawBars(): void {
    const poses = this.model?.asset.poses ?? [];
    const most = Math.max(...poses.map((pose) => pose.probability));
    byId("pose-bars").replaceChildren(
      ...poses.map((pose, index) => {
        const bar = h("i", { class: index === this.pose ? "now" : "" });
        bar.style.height = `${Math.max(12, (100 * pose.probability) / most)}%`;
        return bar;
      }),
    );
  }
}

function makeStage(): Stage | null {
  try {
    return new Stage(byId<HTMLCanvasElement>("canvas"));
  } catch {
    byId("no-webgl").hidden = false;
    return null;
  }
}
