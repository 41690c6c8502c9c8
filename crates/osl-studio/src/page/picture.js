// The picture, and the pixel to which the mouse or the keys point.

const OPAQUE = 0xff000000;

/** Writes the samples of each pixel as one word, with red in its lowest byte: a loop over bytes takes four times
 * as long. */
function spread(samples, channels, words) {
  const count = words.length;
  if (channels === 3) {
    for (let at = 0, from = 0; at < count; at += 1, from += 3) {
      words[at] = OPAQUE | (samples[from + 2] << 16) | (samples[from + 1] << 8) | samples[from];
    }
  } else if (channels === 4) {
    for (let at = 0, from = 0; at < count; at += 1, from += 4) {
      words[at] = (samples[from + 3] << 24) | (samples[from + 2] << 16) | (samples[from + 1] << 8) | samples[from];
    }
  } else {
    for (let at = 0, from = 0; at < count; at += 1, from += channels) {
      words[at] = (channels === 2 ? samples[from + 1] << 24 : OPAQUE) | (samples[from] * 0x010101);
    }
  }
}

/** The pane with the picture. */
export class PicturePane {
  /** `zoom` says where the picture is; `pointed([x, y])` is called when another pixel is chosen. */
  constructor(canvas, cross, zoom, pointed) {
    Object.assign(this, { canvas, cross, zoom, pointed });
    this.size = [0, 0];
    canvas.addEventListener("pointermove", (event) => zoom.isDragging || this.pointAt(event));
    canvas.addEventListener("pointerdown", (event) => this.pointAt(event));
    canvas.addEventListener("keydown", (event) => this.key(event));
    zoom.frame.addEventListener("placed", () => this.placeCross());
  }

  /** Shows a picture. `size` is that of the whole picture, also for a coarse one. */
  show(message, samples, size) {
    const { width, height, channels } = message;
    if (this.image?.width !== width || this.image.height !== height) {
      this.image = new ImageData(width, height);
      this.words = new Uint32Array(this.image.data.buffer);
    }
    spread(samples, channels, this.words);
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.canvas.getContext("2d").putImageData(this.image, 0, 0);
    this.size = size;
    this.zoom.resize(size);
  }

  /** Whether there is no picture. */
  get isEmpty() {
    return !this.image;
  }

  /** Shows no picture, and points at no pixel. */
  clear() {
    this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
    Object.assign(this, { image: null, words: null, at: null, size: [0, 0] });
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
      this.zoom.reveal(this.at);
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
      const [box, frame] = [this.canvas.getBoundingClientRect(), this.zoom.frame.getBoundingClientRect()];
      // A large pixel is framed.
      const side = Math.max(9, box.width / this.size[0] + 1);
      Object.assign(this.cross.style, {
        left: `${box.left - frame.left + ((this.at[0] + 0.5) / this.size[0]) * box.width}px`,
        top: `${box.top - frame.top + ((this.at[1] + 0.5) / this.size[1]) * box.height}px`,
        width: `${side}px`,
        height: `${side}px`,
      });
    }
  }
}
