// A pinned picture over the left part of the present one, up to where a slider stands.

/** Lets a button pin the picture of a canvas. */
export class Wipe {
  constructor({ canvas, pinned, button, slider, word }) {
    Object.assign(this, { canvas, pinned, button, slider, word });
    button.onclick = () => (pinned.hidden ? this.pin() : this.unpin());
    slider.oninput = () => this.place();
  }

  pin() {
    this.pinned.width = this.canvas.width;
    this.pinned.height = this.canvas.height;
    this.pinned.getContext("2d").drawImage(this.canvas, 0, 0);
    this.show(true);
    this.place();
  }

  unpin() {
    this.show(false);
  }

  show(isPinned) {
    this.pinned.hidden = !isPinned;
    this.slider.hidden = !isPinned;
    this.button.setAttribute("aria-pressed", String(isPinned));
    this.button.textContent = isPinned ? "Unpin" : "Pin";
    this.word.textContent = isPinned ? "left: pinned, right: now" : "";
  }

  place() {
    this.pinned.style.clipPath = `inset(0 ${100 - this.slider.value}% 0 0)`;
  }
}
