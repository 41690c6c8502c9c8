// Which part of the picture is seen, and how large: with the wheel, by dragging, with two fingers, and with keys.
//
// A view has `zoom`, the pixels of the page for each pixel of the picture, and `x` and `y`, the place of the
// picture in the middle of the frame. Without a view the whole picture is seen, as large as fits with whole pixels of
// the page for each of its pixels. The canvas itself is moved and stretched, so whoever asks for its box finds the
// right pixel.

const LARGEST = 64;
/** From this zoom on, lines separate the pixels. */
const GRID = 8;
/** A pointer that moves less far, in pixels, does not drag. */
const STILL = 3;

export class Zoom {
  /** `changed(text)` is called after each change of the view, with its text for the address, if there is a view. */
  constructor({ frame, canvas, pinned, grid, buttons, changed }) {
    Object.assign(this, { frame, canvas, pinned, grid, buttons, changed });
    this.size = [0, 0];
    this.view = null;
    this.pointers = new Map();
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.up(event));
    }
    canvas.addEventListener("dblclick", () => this.fit());
    document.addEventListener("keydown", (event) => this.key(event));
    buttons.in.onclick = () => this.step(2);
    buttons.out.onclick = () => this.step(0.5);
    buttons.fit.onclick = () => this.fit();
    new ResizeObserver(() => this.apply()).observe(frame.parentElement);
  }

  /** Sets columns and rows of the picture. */
  resize(size) {
    if (String(size) !== String(this.size)) {
      this.size = size;
      this.apply();
    }
  }

  /** Sets the view from the text in the address; without a text, the whole picture is seen. */
  read(text) {
    const [zoom, x, y] = (text ?? "").split(",").map(Number);
    const isView = [zoom, x, y].every(Number.isFinite) && zoom > 0;
    this.view = isView ? { zoom: Math.min(zoom, LARGEST), x, y } : null;
    this.apply();
  }

  /** The view as text. */
  get text() {
    const round = (number) => Number(number.toFixed(2));
    return this.view ? [this.view.zoom, this.view.x, this.view.y].map(round).join(",") : undefined;
  }

  /** Whether a pointer moves the picture now. */
  get isDragging() {
    return this.pointers.size > 1 || [...this.pointers.values()].some((pointer) => pointer.drags);
  }

  /** The width of the pane. */
  get room() {
    const { paddingLeft, paddingRight } = getComputedStyle(this.frame.parentElement);
    return this.frame.parentElement.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
  }

  /** The zoom at which the whole picture is seen. */
  get whole() {
    const { room, size: [width, height] } = this;
    if (!width) {
      return 1;
    }
    const fits = Math.floor(room / Math.max(width, height));
    return fits > 1 ? Math.min(LARGEST, fits) : Math.min(1, room / width);
  }

  /** Width and height of the frame for a zoom. */
  frameOf(zoom) {
    const [width, height] = this.size;
    return [Math.min(this.room, width * zoom), Math.min(Math.max(height * this.whole, this.room), height * zoom)];
  }

  /** The share of the columns of the picture that is left of a place in the frame, which is a share of its width. */
  columnsBefore(share) {
    const [frame, box] = [this.frame.getBoundingClientRect(), this.canvas.getBoundingClientRect()];
    return box.width > 0 ? (frame.left + share * frame.width - box.left) / box.width : share;
  }

  /** Shows the whole picture. */
  fit() {
    this.set(null);
  }

  /** Zooms by a factor about the middle. */
  step(factor) {
    const box = this.frame.getBoundingClientRect();
    this.about(factor, box.left + box.width / 2, box.top + box.height / 2);
  }

  /** Zooms by a factor; the place of the picture under a point of the page stays there. False if nothing changes. */
  about(factor, pageX, pageY) {
    if (!this.size[0]) {
      return false;
    }
    const now = this.view?.zoom ?? this.whole;
    // Small steps add up until they make a difference.
    this.wanted = Math.min(LARGEST, Math.max(this.whole, (this.wanted ?? now) * factor));
    const zoom = this.wanted >= 2 ? Math.round(this.wanted) : this.wanted;
    if (zoom === now) {
      return this.wanted > this.whole && this.wanted < LARGEST;
    }
    if (zoom <= this.whole) {
      this.set(null);
      return true;
    }
    const [box, frame] = [this.canvas.getBoundingClientRect(), this.frame.getBoundingClientRect()];
    const [width, height] = this.frameOf(zoom);
    this.set({
      zoom,
      x: ((pageX - box.left) / box.width) * this.size[0] - (pageX - frame.left - width / 2) / zoom,
      y: ((pageY - box.top) / box.height) * this.size[1] - (pageY - frame.top - height / 2) / zoom,
    }, this.wanted);
    return true;
  }

  /** Moves the picture by pixels of the page. */
  pan(right, down) {
    if (this.view) {
      const { zoom, x, y } = this.view;
      this.set({ zoom, x: x - right / zoom, y: y - down / zoom }, this.wanted);
    }
  }

  /** Moves the picture so that a pixel is seen. */
  reveal([column, row]) {
    if (this.view) {
      const { zoom, x, y } = this.view;
      const [width, height] = this.frameOf(zoom).map((side) => side / zoom / 2);
      const near = (middle, pixel, half) => Math.max(pixel + 1 - half, Math.min(middle, pixel + half));
      const [newX, newY] = [near(x, column, width), near(y, row, height)];
      if (newX !== x || newY !== y) {
        this.set({ zoom, x: newX, y: newY });
      }
    }
  }

  /** Changes the view. `wanted` is its zoom before it is rounded. */
  set(view, wanted) {
    Object.assign(this, { view, wanted });
    this.apply();
    this.changed(this.text);
  }

  /** Places the picture in the frame. */
  apply() {
    const { frame, canvas, pinned, grid, buttons } = this;
    const [width, height] = this.size;
    frame.classList.toggle("zoomed", this.view !== null);
    grid.hidden = !(this.view?.zoom >= GRID);
    buttons.fit.textContent = this.view ? `${Number(this.view.zoom.toFixed(2))}×` : "fit";
    if (!this.view || !width) {
      Object.assign(frame.style, { width: "", height: "" });
      Object.assign(pinned.style, { width: "", height: "", transform: "" });
      Object.assign(canvas.style, { width: `${width * Math.max(1, this.whole)}px`, height: "", transform: "", aspectRatio: `${width} / ${height}` });
      this.placed();
      return;
    }
    const { zoom } = this.view;
    const [frameWidth, frameHeight] = this.frameOf(zoom);
    // The middle of the frame is in the picture. Its borders need not be, so that the place under the mouse can stay.
    this.view.x = Math.min(Math.max(this.view.x, 0), width);
    this.view.y = Math.min(Math.max(this.view.y, 0), height);
    // Whole pixels of the page, so that the lines of the grid are at the borders of the pixels.
    const left = Math.round(frameWidth / 2 - this.view.x * zoom);
    const top = Math.round(frameHeight / 2 - this.view.y * zoom);
    Object.assign(frame.style, { width: `${frameWidth}px`, height: `${frameHeight}px` });
    const place = { width: `${width * zoom}px`, height: `${height * zoom}px`, transform: `translate(${left}px, ${top}px)` };
    Object.assign(canvas.style, { ...place, aspectRatio: "" });
    Object.assign(pinned.style, place);
    grid.style.backgroundSize = `${zoom}px ${zoom}px`;
    grid.style.backgroundPosition = `${left % zoom}px ${top % zoom}px`;
    this.placed();
  }

  /** Tells those who draw over the picture. */
  placed() {
    this.frame.dataset.view = this.text ?? "";
    this.frame.dispatchEvent(new Event("placed"));
  }

  wheel(event) {
    const pixels = event.deltaY * [1, 16, 100][event.deltaMode];
    // Two fingers on a touchpad send small steps with Ctrl.
    const factor = 2 ** (-pixels / (event.ctrlKey ? 60 : 240));
    // A picture that cannot become smaller lets the pane scroll.
    if (this.about(Math.min(4, Math.max(0.25, factor)), event.clientX, event.clientY) || event.ctrlKey) {
      event.preventDefault();
    }
  }

  down(event) {
    if (event.button === 0) {
      this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, drags: false });
      this.canvas.setPointerCapture(event.pointerId);
    }
  }

  move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) {
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, other]) => other);
      const distance = ({ x, y }) => Math.max(1, Math.hypot(x - other.x, y - other.y));
      const [x, y] = [(now.x + other.x) / 2, (now.y + other.y) / 2];
      this.about(distance(now) / distance(pointer), x, y);
      this.pan((now.x - pointer.x) / 2, (now.y - pointer.y) / 2);
    } else if (this.view) {
      if (!pointer.drags && Math.hypot(now.x - pointer.x, now.y - pointer.y) < STILL) {
        return;
      }
      pointer.drags = true;
      this.pan(now.x - pointer.x, now.y - pointer.y);
    }
    Object.assign(pointer, now);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
  }

  key(event) {
    const isTyping = event.target.matches?.("input, select, textarea");
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    const keys = { "+": () => this.step(2), "=": () => this.step(2), "-": () => this.step(0.5), 0: () => this.fit() };
    if (keys[event.key]) {
      event.preventDefault();
      keys[event.key]();
    }
  }
}
