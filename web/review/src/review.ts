// The page: which asset is shown, and what keys and buttons do with it.

import * as api from "./api";
import { Details } from "./details";
import { AssetList } from "./list";
import { byId, isTyping } from "./dom";
import { fillHelp, type Key, keyName } from "./keys";
import { loadModel, type Model } from "./models";
import { Rejection } from "./rejection";
import { Viewer } from "./viewer";

const AHEAD = 2;
const PAST: Record<api.Verdict, string> = { accept: "accepted", edit: "edited", reject: "rejected" };

class Review {
  private overview!: api.Overview;
  private current: api.Row | null = null;
  private model: Model | null = null;
  private isBusy = false;
  private readonly viewer = new Viewer();
  private readonly list = new AssetList((row) => void this.open(row));
  private readonly details = new Details((change) => void this.decide("edit", { change }));
  private readonly rejection = new Rejection((reason) => void this.decide("reject", { reason }));
  private readonly keys: Key[] = [
    { key: "a", does: "Accept, and go to the next that is open", run: () => void this.decide("accept") },
    { key: "e", does: "Edit the values; Enter saves", run: () => this.details.edit() },
    { key: "r", does: "Reject, with a reason", run: () => this.current && this.rejection.open(this.current.name) },
    { key: "u", does: "Undo your last decision, as often as you like", run: () => void this.undo() },
    { key: "ArrowRight", also: ["j"], does: "Next asset", run: () => this.step(1) },
    { key: "ArrowLeft", also: ["k"], does: "Previous asset", run: () => this.step(-1) },
    { key: "n", does: "Next asset that is open", run: () => this.openNext() },
    ...this.viewer.keys,
    { key: "/", does: "Find an asset", run: () => this.list.find() },
    { key: "?", does: "These keys", run: () => byId<HTMLDialogElement>("help").showModal() },
  ];

  async start(): Promise<void> {
    const clicks: [string, string][] = [["accept", "a"], ["edit", "e"], ["reject", "r"], ["undo", "u"], ["help-open", "?"]];
    for (const [id, key] of clicks) byId(id).addEventListener("click", () => this.keys.find((item) => item.key === key)?.run());
    byId("list-toggle").addEventListener("click", () => this.list.toggle());
    document.addEventListener("keydown", (event) => this.press(event));
    document.addEventListener("visibilitychange", () => void (document.hidden || this.refresh()));
    fillHelp(this.keys);
    await this.refresh();
    document.title = `Review of ${this.overview.library}`;
    byId("library").textContent = this.overview.library;
    byId("reviewer").textContent = this.overview.reviewer;
    this.details.setMaterials(this.overview.materials);
    const last = this.overview.assets.findIndex((row) => row.name === this.overview.undoable?.asset_name);
    const first = this.nextOpen(last) ?? this.overview.assets[0];
    if (first) await this.open(first);
    else this.say("This library has no assets.");
  }

  private press(event: KeyboardEvent): void {
    const isUndo = (event.ctrlKey || event.metaKey) && event.key === "z";
    if (isTyping(event.target) || document.querySelector("dialog[open]")) return;
    if ((event.ctrlKey || event.metaKey || event.altKey) && !isUndo) return;
    const name = isUndo ? "u" : keyName(event);
    if (name === " " && event.target instanceof HTMLButtonElement) return;
    const found = this.keys.find((item) => item.key === name || item.also?.includes(name));
    if (!found) return;
    event.preventDefault();
    if (!event.repeat || found.mayRepeat) found.run();
  }

  private async decide(decision: api.Verdict, extra: { change?: api.Change; reason?: string } = {}): Promise<void> {
    const row = this.current;
    if (!row || this.model?.asset.hash !== row.hash) return; // what is not on the page yet is not decided on
    const answer = await this.ask(() => api.postDecision({ asset_hash: row.hash, decision, ...extra }));
    if (!answer) return;
    this.say(`${row.name} ${PAST[decision]}`);
    if (decision === "edit") await this.open(answer.asset);
    else this.openNext();
  }

  private async undo(): Promise<void> {
    const { undoable } = this.overview;
    if (!undoable) return this.say("Nothing to undo");
    const answer = await this.ask(() => api.postUndo(undoable.entry_id));
    if (!answer) return;
    this.say(`${undoable.asset_name} is not ${PAST[undoable.decision]} any more`);
    await this.open(answer.asset);
  }

  /** One request at a time, so that a key pressed twice decides once. */
  private async ask(request: () => Promise<api.Decided>): Promise<api.Decided | null> {
    if (this.isBusy) return null;
    this.isBusy = true;
    try {
      const answer = await request();
      this.take(answer);
      return answer;
    } catch (error) {
      await this.explain(error);
      return null;
    } finally {
      this.isBusy = false;
    }
  }

  private async explain(error: unknown): Promise<void> {
    byId("offline").hidden = !(error instanceof api.Unreachable);
    if (error instanceof api.Unreachable) return;
    this.say(error instanceof Error ? error.message : String(error), true);
    if (error instanceof api.Refused && (error.status === 404 || error.status === 409)) {
      await this.refresh();
      const row = this.overview.assets.find((item) => item.name === this.current?.name);
      if (row && row.hash !== this.current?.hash) await this.open(row);
    }
  }

  /** Other tabs and reviewers may have decided meanwhile. */
  private async refresh(): Promise<void> {
    try {
      this.overview = await api.getOverview();
      byId("offline").hidden = true;
    } catch (error) {
      if (error instanceof api.Unreachable && this.overview) {
        byId("offline").hidden = false;
        return;
      }
      throw error;
    }
    this.showProgress();
    const row = this.overview.assets.find((item) => item.name === this.current?.name);
    if (row && row.hash === this.current?.hash && this.model) {
      this.current = row;
      this.details.show(this.model.asset, row);
    }
  }

  private take(answer: api.Decided): void {
    const index = this.overview.assets.findIndex((row) => row.name === answer.asset.name);
    this.overview.assets[index] = answer.asset;
    this.overview.undoable = answer.undoable;
    byId("offline").hidden = true;
    this.showProgress();
  }

  private showProgress(): void {
    const { assets, undoable } = this.overview;
    const counts = { accept: 0, edit: 0, reject: 0 };
    for (const row of assets) if (row.decision) counts[row.decision] += 1;
    const done = counts.accept + counts.edit + counts.reject;
    const bar = byId("progress");
    bar.setAttribute("aria-valuemax", String(assets.length));
    bar.setAttribute("aria-valuenow", String(done));
    for (const [verdict, count] of Object.entries(counts)) {
      const piece = bar.querySelector<HTMLElement>(`.${verdict}`);
      if (piece) piece.style.width = `${(100 * count) / Math.max(assets.length, 1)}%`;
    }
    byId("progress-text").textContent = `${done} of ${assets.length}`;
    bar.title = `${counts.accept} accepted, ${counts.edit} edited, ${counts.reject} rejected`;
    byId<HTMLButtonElement>("undo").disabled = !undoable;
    byId("undo-text").textContent = undoable ? `Undo: ${undoable.asset_name} ${PAST[undoable.decision]}` : "Nothing to undo";
    this.list.show(assets, this.current?.name ?? null);
  }

  private async open(row: api.Row): Promise<void> {
    this.current = row;
    this.list.mark(row.name);
    try {
      const model = await loadModel(row.hash);
      if (this.current.hash !== row.hash) return;
      this.model = model;
      this.viewer.show(model);
      this.details.show(model.asset, row);
      for (const next of this.list.after(row.name, AHEAD)) loadModel(next.hash).catch(() => undefined);
    } catch (error) {
      if (this.current.hash === row.hash) await this.explain(error);
    }
  }

  private step(by: number): void {
    const row = this.list.neighbour(this.current?.name ?? null, by);
    if (row) void this.open(row);
  }

  private openNext(): void {
    const index = this.overview.assets.findIndex((row) => row.name === this.current?.name);
    const next = this.nextOpen(index);
    if (next) void this.open(next);
    else {
      const row = this.overview.assets[index];
      if (row) void this.open(row);
      this.say(`All ${this.overview.assets.length} assets are reviewed`);
    }
  }

  /** The first asset after this place that nobody has decided on, starting again at the top. */
  private nextOpen(index: number): api.Row | undefined {
    const { assets } = this.overview;
    return [...assets.slice(index + 1), ...assets.slice(0, index + 1)].find((row) => !row.decision);
  }

  private say(text: string, isProblem = false): void {
    const status = byId("status");
    status.textContent = text;
    status.classList.toggle("problem", isProblem);
    status.classList.remove("fresh");
    void status.offsetWidth; // so that the animation starts again
    status.classList.add("fresh");
  }
}

new Review().start().catch((error: unknown) => {
  const status = byId("status");
  status.textContent = error instanceof Error ? error.message : String(error);
  status.classList.add("problem", "fresh");
});
