// The connection to the server: opens it, opens it again when it is lost, and decides when a state is sent.
//
// While the mouse drags a slider there are more states than pictures. A state waits for the picture of the last
// one, but not for long: then it is sent, and the server gives up the outdated picture.

const PATIENCE = 100;
const AGAIN = 1000;

export class Connection {
  /** The callbacks: `opened()`, `lost()`, `message(object, samples)`. */
  constructor(callbacks) {
    this.callbacks = callbacks;
    this.nextId = 1;
    this.open();
  }

  open() {
    this.waiting = null;
    this.inFlight = null;
    this.point = null;
    this.pointInFlight = null;
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    address.hash = "";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.callbacks.opened();
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => {
      this.callbacks.lost();
      setTimeout(() => this.open(), AGAIN);
    };
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** Whether the picture of the newest state has not come yet. */
  get isBusy() {
    return this.waiting !== null || this.inFlight !== null;
  }

  /** Shows a state as soon as possible; a newer one replaces it. */
  show(state) {
    this.waiting = state;
    this.sendWaiting();
  }

  sendWaiting() {
    if (!this.waiting || !this.isOpen) {
      return;
    }
    if (this.inFlight) {
      const left = this.inFlight.sent + PATIENCE - performance.now();
      if (left > 0) {
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.sendWaiting(), left);
        return;
      }
    }
    const id = this.nextId++;
    this.inFlight = { id, sent: performance.now() };
    this.socket.send(JSON.stringify({ type: "state", id, state: this.waiting }));
    this.waiting = null;
  }

  /** Asks for the explanation of a pixel; at most one request is on its way. */
  explain(at) {
    this.point = at;
    this.sendPoint();
  }

  sendPoint() {
    if (this.point && !this.pointInFlight && this.isOpen) {
      this.pointInFlight = this.nextId++;
      this.socket.send(JSON.stringify({ type: "point", id: this.pointInFlight, at: this.point }));
      this.point = null;
    }
  }

  /** Asks what a line does. The server gives up an earlier line. */
  line(line) {
    if (this.isOpen) {
      this.socket.send(JSON.stringify({ type: "line", id: this.nextId++, line }));
    }
  }

  /** Asks the server to keep the values of the picture, or to forget them; false if there is no connection. */
  pin(pinned) {
    if (this.isOpen) {
      this.socket.send(JSON.stringify({ type: "pin", id: this.nextId++, pinned }));
    }
    return this.isOpen;
  }

  /** Asks for the state as the text of a group. */
  group() {
    if (this.isOpen) {
      this.socket.send(JSON.stringify({ type: "group", id: this.nextId++ }));
    }
  }

  /** Lets a file have a text that is not saved; without one, it has its own again. */
  unsaved(file, text) {
    if (this.isOpen) {
      this.socket.send(JSON.stringify({ type: "unsaved", file, text }));
    }
  }

  /** Asks the server to save a text; false if there is no connection. */
  save(edit) {
    if (this.isOpen) {
      this.socket.send(JSON.stringify({ type: "save", id: this.nextId++, ...edit }));
    }
    return this.isOpen;
  }

  receive(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.type === "explanation") {
        this.pointInFlight = null;
      }
      this.answered(message, false);
      this.callbacks.message(message, null);
      this.sendPoint();
      return;
    }
    const length = new DataView(data).getUint32(0, true);
    const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    // The next state is on its way while this picture is drawn.
    this.answered(message, message.coarse);
    this.callbacks.message(message, new Uint8Array(data, 4 + length));
  }

  /** After an answer the next state may be sent; a coarse picture is enough if there is one. */
  answered(message, isCoarse) {
    const isState = message.type === "picture" || message.type === "failed";
    if (isState && message.id === this.inFlight?.id && (!isCoarse || this.waiting)) {
      this.inFlight = null;
      this.sendWaiting();
    }
  }
}
