// Sections stand open on wide screens and on paper; on a phone they are a list of headings to open.
if (matchMedia("screen and (max-width: 40rem)").matches) {
  for (const one of document.querySelectorAll("details.fold")) one.open = false;
  const show = () => {
    const fold = location.hash && document.querySelector(location.hash)?.closest("details.fold");
    if (fold) fold.open = true;
  };
  addEventListener("hashchange", show);
  show();
}
