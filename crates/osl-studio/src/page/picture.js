// The picture, and the pixel to which the mouse or the keys point.

/** The pane with the picture. */
export class PicturePane {
  /** `pointed([x, y])` is called when another pixel is chosen. */
  constructor(canvas, cross, pointed) {
    this.canvas = canvas;
    this.cross = cross;
    this.pointed = pointed;
    this.size = [0, 0];
    canvas.addEventListener("pointermove", (event) => this.pointAt(event));
    canvas.addEventListener("pointerdown", (event) => this.pointAt(event));
    canvas.addEventListener("keydown", (event) => this.key(event));
    addEventListener("resize", () => this.placeCross());
  }

  /** Shows a picture. `size` is that of the whole picture, also for a coarse one. */
  show(message, samples, size) {
    const { width, height, channels } = message;
    const pixels = new Uint8ClampedArray(width * height * 4);
    const isGrey = channels < 3;
    const hasAlpha = channels % 2 === 0;
    for (let from = 0, to = 0; to < pixels.length; from += channels, to += 4) {
      pixels[to] = samples[from];
      pixels[to + 1] = samples[isGrey ? from : from + 1];
      pixels[to + 2] = samples[isGrey ? from : from + 2];
      pixels[to + 3] = hasAlpha ? samples[from + channels - 1] : 255;
    }
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.canvas.style.width = `${size[0]}px`;
    this.canvas.style.aspectRatio = `${size[0]} / ${size[1]}`;
    this.canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
    this.size = size;
    this.placeCross();
  }

  pointAt(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * this.size[0]);
    const y = Math.floor(((event.clientY - box.top) / box.height) * this.size[1]);
    this.point(x, y);
  }

  key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const step = steps[event.key];
    if (step) {
      event.preventDefault();
      const by = event.shiftKey ? 16 : 1;
      const [x, y] = this.at ?? this.size.map((n) => n >> 1);
      this.point(x + step[0] * by, y + step[1] * by);
    }
  }

  point(x, y) {
    const inside = (n, size) => Math.max(0, Math.min(n, size - 1));
    const at = [inside(x, this.size[0]), inside(y, this.size[1])];
    if (this.size[0] > 0 && String(at) !== String(this.at)) {
      this.at = at;
      this.placeCross();
      this.pointed(at);
    }
  }

  placeCross() {
    this.cross.hidden = !this.at;
    if (this.at) {
      const box = this.canvas.getBoundingClientRect();
      this.cross.style.left = `${((this.at[0] + 0.5) / this.size[0]) * box.width}px`;
      this.cross.style.top = `${((this.at[1] + 0.5) / this.size[1]) * box.height}px`;
    }
  }
}
