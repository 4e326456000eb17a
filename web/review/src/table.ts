// The table under the asset: a shadow, and lines at a round distance that tell its size.

import { BufferGeometry, CircleGeometry, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, Mesh, ShadowMaterial } from "three";

const STEPS_M = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
const GREY = 0.5;

export class Table extends Group {
  step = 0.05;
  private readonly shadow = new Mesh(new CircleGeometry(1, 64), new ShadowMaterial({ opacity: 0.27 }));
  private readonly lines = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }),
  );

  constructor() {
    super();
    this.shadow.receiveShadow = true;
    this.shadow.position.z = -1e-4;
    this.lines.position.z = -2e-4;
    this.add(this.shadow, this.lines);
  }

  /** Draw for an object of this radius [m]. */
  fit(radius: number): void {
    this.step = STEPS_M.find((step) => step >= radius / 4) ?? 0.2;
    this.shadow.scale.setScalar(4 * radius);
    const { positions, colours } = fadingGrid(2.6 * radius, this.step);
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry()
      .setAttribute("position", new Float32BufferAttribute(positions, 3))
      .setAttribute("color", new Float32BufferAttribute(colours, 4));
  }
}

/** Lines in pieces, each fainter the farther it lies from the middle. */
function fadingGrid(size: number, step: number): { positions: number[]; colours: number[] } {
  const positions: number[] = [];
  const colours: number[] = [];
  const count = Math.ceil(size / step);
  const add = (x: number, y: number): void => {
    const share = Math.min(Math.hypot(x, y) / size, 1);
    positions.push(x, y, 0);
    colours.push(GREY, GREY, GREY, 0.7 * (1 - share) ** 1.4);
  };
  for (let line = -count; line <= count; line++) {
    for (let piece = -count; piece < count; piece++) {
      add(line * step, piece * step);
      add(line * step, (piece + 1) * step);
      add(piece * step, line * step);
      add((piece + 1) * step, line * step);
    }
  }
  return { positions, colours };
}
