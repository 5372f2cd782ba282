// Content of the map: the category of each cell.
() => {
  const found = [];
  for (const rect of document.querySelectorAll("rect[data-sg-intent]")) {
    const category = rect.parentElement.getAttribute("fill").match(/sg-way-(\d+)/)[1];
    found[JSON.parse(rect.dataset.sgIntent).cell] = Number(category);
  }
  return found;
}
