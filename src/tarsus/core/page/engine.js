// The engine in a page or in Node: one packet in its memory, run again and again with other numbers in its row.
class Engine {
  // module: a WebAssembly.Module; packet: an ArrayBuffer. Throws an Error with the engine's words for a packet that is none.
  constructor(module, packet) {
    Object.assign(this, { module, packet });
    this.begin();
  }

  begin() {
    const asked = {};
    for (const { module, name } of WebAssembly.Module.imports(this.module)) {
      (asked[module] ??= {})[name] = () => { throw new Error(`the engine asked for ${name}`); };
    }
    this.calls = new WebAssembly.Instance(this.module, asked).exports;
    this.calls._initialize();
    const bytes = this.packet.byteLength, at = this.calls.reserve(bytes);
    new Uint8Array(this.calls.memory.buffer).set(new Uint8Array(this.packet), at);
    this.plan = this.told(() => this.calls.plan(at, bytes));
    this.parts = this.places(at);
  }

  // What a call gives; what stops the engine is an Error with its words.
  told(call) {
    try {
      return call();
    } catch (error) {
      const bytes = new Uint8Array(this.calls.memory.buffer), at = this.calls.trouble();
      throw new Error(new TextDecoder().decode(bytes.subarray(at, bytes.indexOf(0, at))) || error.message);
    }
  }

  // Where each array of the packet stands: see packet/packet.hpp.
  places(at) {
    const view = new DataView(this.calls.memory.buffer), names = new TextDecoder(), out = {};
    let left = Number(view.getBigInt64(at + 8, true));
    for (at += 16; left--;) {
      const name = names.decode(new Uint8Array(view.buffer, at, 48)).replace(/\0+$/, '');
      const kind = view.getBigInt64(at + 48, true) ? BigInt64Array : Float64Array, count = Number(view.getBigInt64(at + 56, true));
      out[name] = { kind, at: at + 64, count };
      at += 64 + 8 * count;
    }
    return out;
  }

  // An array of the packet, as it is now; good until the next run.
  array(name) {
    const { kind, at, count } = this.parts[name];
    return new kind(this.calls.memory.buffer, at, count);
  }

  // A run with so many samples from its start to its end: code, or refusals (rows of 4: run, fault, foot, by) where it cannot start;
  // events in rows of 12, samples in rows of `width`, marks, finish. After a failure the engine is made anew, with the packet's own
  // numbers.
  run(frames) {
    const { calls, plan } = this;
    let code;
    try {
      code = this.told(() => calls.run(plan, frames));
    } catch (error) {
      this.begin();
      throw error;
    }
    const taken = (at, count) => new Float64Array(calls.memory.buffer, at, count).slice();
    return {
      code, finish: taken(calls.finish(plan), 3), width: calls.sample_width(plan), memory: calls.memory.buffer.byteLength,
      events: taken(calls.events(plan), calls.event_numbers(plan)), marks: taken(calls.marks(plan), calls.mark_numbers(plan)),
      samples: code < 0 ? new Float64Array(0) : taken(calls.samples(plan), frames * calls.sample_width(plan)),
      refusals: taken(calls.refusals(plan), calls.refusal_numbers(plan)),
    };
  }
}
