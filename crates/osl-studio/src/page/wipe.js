// A pinned picture over the left part of the present one, up to where a slider stands.

/** Lets a button pin the picture of a canvas. */
export class Wipe {
  /** `ask(isPinned)` asks the server to keep the values or to forget them, and is false if there is no server;
   * `changed(isPinned)` is called when a picture is pinned and when it is not any more. */
  constructor({ canvas, pinned, zoom, button, slider, word, ask, changed }) {
    Object.assign(this, { canvas, pinned, zoom, button, slider, word, ask, changed, covers: true });
    button.onclick = () => (pinned.hidden ? this.pin() : this.unpin());
    slider.oninput = () => this.place();
    zoom.frame.addEventListener("placed", () => this.place());
  }

  /** Pins the picture, when the server has kept its values. */
  pin() {
    if (!this.ask(true)) {
      this.keep();
    }
  }

  /** Pins the picture. */
  keep() {
    this.pinned.width = this.canvas.width;
    this.pinned.height = this.canvas.height;
    this.pinned.getContext("2d").drawImage(this.canvas, 0, 0);
    this.show(true);
    this.place();
  }

  unpin() {
    this.ask(false);
    this.show(false);
  }

  show(isPinned) {
    this.pinned.hidden = !isPinned;
    this.button.setAttribute("aria-pressed", String(isPinned));
    this.button.textContent = isPinned ? "Unpin" : "Pin";
    this.cover(this.covers);
    this.changed(isPinned);
  }

  /** Sets whether the pinned picture covers the left part of the present one: it does not cover the difference. */
  cover(covers) {
    const isSeen = covers && !this.pinned.hidden;
    this.covers = covers;
    this.pinned.style.visibility = covers ? "" : "hidden";
    this.slider.hidden = !isSeen;
    this.word.textContent = isSeen ? "left: pinned, right: now" : "";
  }

  place() {
    // The border stays at its place in the frame when the picture is moved or enlarged.
    const share = this.zoom.columnsBefore(this.slider.value / 100);
    const right = 100 * (1 - Math.min(1, Math.max(0, share)));
    this.pinned.style.clipPath = `inset(0 ${Number(right.toFixed(3))}% 0 0)`;
  }
}
