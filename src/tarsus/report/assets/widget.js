// The explorer in a notebook: its page in a frame, whose sliders and measures are those of the model.
export default {
  render({ model, el }) {
    const frame = Object.assign(document.createElement("iframe"), { title: "explorer", srcdoc: model.get("page") });
    Object.assign(frame.style, { width: "100%", height: "60rem", border: "0" });
    let known = "{}";
    const heard = ({ data, source }) => {
      if (source !== frame.contentWindow || !data?.tarsus) return;
      known = JSON.stringify(data.tarsus.values);
      model.set("values", data.tarsus.values);
      model.set("measures", data.tarsus.measures);
      model.save_changes();
    };
    const told = () => {
      const values = model.get("values");
      if (JSON.stringify(values) !== known) frame.contentWindow.postMessage({ tarsus: values }, "*");
    };
    addEventListener("message", heard);
    model.on("change:values", told);
    frame.addEventListener("load", told);
    el.append(frame);
    return () => {
      removeEventListener("message", heard);
      model.off("change:values", told);
    };
  },
};
