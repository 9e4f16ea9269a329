// The live connection: frames in, held buttons out. It says at once when it is lost and comes back by itself.
const RETRY_MS = 1000;
const SILENT_MS = 1000; // the server sends 20 frames a second
const LOOK_MS = 200;
const AGAIN_MS = 5000; // our choice: a connection through two lost packets takes 3 s
const SIGN_MS = 1000; // the server misses a page from which nothing comes for 4 s
const UNKNOWN_PAGE = 4404;

export class Live {
  constructor(path, handlers) {
    this.url = new URL(path, window.location.href.replace(/^http/, "ws"));
    this.handlers = handlers;
    this.heard = performance.now();
    this.lostSince = null;
    this.signed = 0;
    this.connect();
    setInterval(() => this.look(), LOOK_MS);
  }

  connect() {
    this.tried = performance.now();
    this.socket = new WebSocket(this.url);
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = (event) => {
      this.lose();
      if (event.code === UNKNOWN_PAGE) setTimeout(() => window.location.reload(), RETRY_MS);
      else setTimeout(() => this.connect(), RETRY_MS);
    };
  }

  hear(packet) {
    this.heard = performance.now();
    if (this.lostSince !== null) {
      this.lostSince = null;
      this.handlers.back();
    }
    // By what is heard and no timer: those of a tab in the background are slowed down.
    if (this.heard - this.signed > SIGN_MS) {
      this.signed = this.heard;
      this.send({ alive: 1 });
    }
    for (const [kind, content] of Object.entries(packet)) this.handlers[kind](content);
  }

  look() {
    const now = performance.now();
    if (now - this.heard > SILENT_MS) this.lose();
    // Where the network forgets a line, as when a phone roams, no end is ever told: nobody else opens it again.
    if (now - Math.max(this.heard, this.tried) > AGAIN_MS && this.socket.readyState <= WebSocket.OPEN) {
      this.socket.onmessage = this.socket.onclose = null;
      this.socket.close();
      this.connect();
    }
  }

  lose() {
    if (this.lostSince !== null) return;
    this.lostSince = new Date();
    this.handlers.lost(this.lostSince);
  }

  get open() {
    return this.lostSince === null && this.socket.readyState === WebSocket.OPEN;
  }

  // Return whether the packet could be sent.
  send(packet) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(packet));
    return true;
  }
}
