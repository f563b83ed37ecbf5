// Opens the report.
{
  const data = JSON.parse(document.getElementById("data").textContent);
  // Without ticks the page has a placeholder.
  if (data.ticks.time.length > 0) openFigures(openPlayer(data).goTo); else document.documentElement.dataset.ready = "true";
}
