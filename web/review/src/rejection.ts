// Why an asset is rejected: one of the usual reasons by its number, or in words.

import { byId, h, isTyping } from "./dom";

const REASONS = [
  "broken or wrong shape",
  "convex parts do not fit",
  "wrong size",
  "not one object",
  "not fit for the benchmark",
  "licence unclear",
];

export class Rejection {
  private readonly dialog = byId<HTMLDialogElement>("rejection");
  private readonly input = byId<HTMLInputElement>("reason");

  constructor(private readonly onReject: (reason: string) => void) {
    byId("reasons").replaceChildren(
      ...REASONS.map((reason, index) =>
        h("button", { type: "button", onclick: () => this.close(reason) }, h("kbd", {}, String(index + 1)), reason),
      ),
    );
    byId("rejection-form").addEventListener("submit", (event) => {
      event.preventDefault();
      if (this.input.value.trim()) this.close(this.input.value.trim());
    });
    byId("rejection-cancel").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("keydown", (event) => {
      const reason = REASONS[Number(event.key) - 1];
      if (!reason || isTyping(event.target)) return;
      event.preventDefault();
      this.close(reason);
    });
  }

  open(name: string): void {
    byId("rejection-title").textContent = `Why is ${name} rejected?`;
    this.input.value = "";
    this.dialog.showModal();
    byId("reasons").querySelector("button")?.focus();
  }

  private close(reason: string): void {
    this.dialog.close();
    this.onReject(reason);
  }
}
