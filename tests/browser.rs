//! Reports in a browser: linked selection of front points, rotation, sorting of tables, zoom and values of plots, by
//! pointer and by keyboard, without errors on the console.

#[path = "common/devtools.rs"]
mod devtools;
#[path = "common/headless.rs"]
mod headless;

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// Runs a script, which ends with `answer(...)`, in the page; returns its answer.
fn answer(browser: &Path, folder: &Path, page: &str, script: &str) -> Value {
    let notify = "const answer = (value) => { const pre = document.createElement('pre'); pre.id = 'answer'; \
                pre.textContent = JSON.stringify(value); document.body.append(pre); };";
    let listen = "const problems = []; console.error = console.warn = (...all) => problems.push(all.join(' ')); \
                  window.addEventListener('error', (event) => problems.push(event.message));";
    let file = folder.join("tested.html");
    let page = page.replacen("<head>", &format!("<head><script>{listen}</script>"), 1);
    std::fs::write(&file, page.replace("</body>", &format!("<script>{notify}\n{script}</script></body>"))).unwrap();
    let output = headless::dump(browser, folder, &format!("file://{}", file.display()), &["--window-size=1100,1600"]);
    let dom = String::from_utf8_lossy(&output.stdout);
    let message = dom.split_once("<pre id=\"answer\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let (message, _) = message.unwrap_or_else(|| panic!("no answer: {}", String::from_utf8_lossy(&output.stderr)));
    serde_json::from_str(&message.replace("&quot;", "\"").replace("&amp;", "&")).unwrap()
}

const SCRIPT: &str = r#"
const rows = () => [...document.querySelectorAll("table.front tbody tr")];
const pictures = [...document.querySelectorAll("svg.plot")].filter((svg) => svg.querySelector("[data-point]"));
const dotted = pictures.filter((svg) => svg.querySelector("g.dot"));
const chosen = () => ({
  points: [...new Set([...document.querySelectorAll(".chosen")].map((e) => e.dataset.point))],
  pictures: pictures.filter((svg) => svg.querySelector(".chosen")).length,
  rows: rows().filter((row) => row.classList.contains("chosen")).length,
});
const key = (target, name) => target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
const move = (svg, [x, y]) => {
  const box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
  const at = { clientX: box.left + x * scale, clientY: box.top + y * scale, bubbles: true };
  svg.dispatchEvent(new PointerEvent("pointermove", at));
  return at;
};
const place = (svg, point) =>
  svg.querySelector(`g.dot[data-point="${point}"] path`).getAttribute("d").slice(1).split(/[ h]/).slice(0, 2).map(Number);
const seen = { pictures: pictures.length, rows: rows().length, responses: document.querySelectorAll("g.line[data-point]").length };
key(pictures[0], "ArrowRight");
key(pictures[0], "ArrowRight");
seen.keys = chosen();
key(pictures[0], "Escape");
seen.escaped = chosen();
move(dotted[1], place(dotted[1], 3));
seen.hovered = chosen();
dotted[1].dispatchEvent(new PointerEvent("pointerleave"));
seen.left = chosen();
dotted[0].dispatchEvent(new MouseEvent("click", move(dotted[0], place(dotted[0], 1))));
dotted[0].dispatchEvent(new PointerEvent("pointerleave"));
seen.clicked = chosen();
const heads = [...document.querySelectorAll("table.front thead button")];
const column = (i) => rows().map((row) => Number(row.cells[i].dataset.value));
heads[2].click();
seen.ascending = column(2);
heads[2].click();
seen.descending = column(2);
seen.sort = document.querySelectorAll("table.front thead th")[2].getAttribute("aria-sort");
seen.still = chosen();
const line = document.querySelector("g.line[data-point='2'] path");
line.dispatchEvent(new PointerEvent("pointermove", { clientX: -100, clientY: -100, bubbles: true }));
seen.line = chosen();
seen.problems = problems;
answer(seen);
"#;

#[test]
fn a_point_selected_in_one_plot_is_selected_in_all_plots_and_in_the_table() {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut run = cargo_bin_cmd!("mops");
    run.args(["pareto", "pid-pareto", "--points", "5", "--quiet", "--out", out.to_str().unwrap()]).assert().success();
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!page.contains("src=\"http") && !page.contains("@import"), "the page needs no network");
    let message = answer(&browser, folder.path(), &page, SCRIPT);
    // Overshoot over settling time, parallel coordinates, three tuners, and at least one response.
    let pictures = message["pictures"].as_u64().unwrap();
    assert!(pictures >= 6, "{message}");
    assert!(message["rows"].as_u64().unwrap() >= 5, "{message}");
    assert!(message["responses"].as_u64() >= message["rows"].as_u64(), "{message}");
    let everywhere = |point: &str| serde_json::json!({ "points": [point], "pictures": pictures, "rows": 1 });
    let nowhere = serde_json::json!({ "points": [], "pictures": 0, "rows": 0 });
    assert_eq!(message["keys"], everywhere("1"), "two steps to the right select the second row");
    assert_eq!(message["escaped"], nowhere);
    assert_eq!(message["hovered"], everywhere("3"));
    assert_eq!(message["left"], nowhere, "hovering selects only temporarily");
    assert_eq!(message["clicked"], everywhere("1"), "a click selects permanently");
    let numbers = |key: &str| message[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    assert!(numbers("ascending").is_sorted(), "{message}");
    assert!(numbers("descending").iter().rev().is_sorted(), "{message}");
    assert_eq!(message["sort"], "descending");
    assert_eq!(message["still"], everywhere("1"), "sorting keeps the selection");
    assert_eq!(message["line"], everywhere("2"), "touching a line selects it");
    assert_eq!(message["problems"], serde_json::json!([]));
}

const TURNED: &str = r#"
const svg = document.querySelector("svg[data-view]");
const key = (target, name, shiftKey) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key: name, shiftKey, bubbles: true, cancelable: true }));
const place = (point) =>
  svg.querySelector(`g.dot[data-point="${point}"] path`).getAttribute("d").slice(1).split(/[ h]/).slice(0, 2).map(Number);
const all = () => [...svg.querySelectorAll("g[data-space] > path, g[data-space] > text")].map((shape) => shape.outerHTML);
const chosen = () => [...new Set([...document.querySelectorAll(".chosen")].map((e) => e.dataset.point))];
const seen = { dots: svg.querySelectorAll("g.dot").length, rows: document.querySelectorAll("table.front tbody tr").length };
const [before, drawn] = [place(0), all()];
key(svg, "ArrowRight", true);
seen.turned = { moved: place(0)[0] !== before[0], shapes: all().filter((shape, i) => shape !== drawn[i]).length, chosen: chosen() };
key(svg, "ArrowLeft", true);
seen.back = Math.hypot(place(0)[0] - before[0], place(0)[1] - before[1]);
const drag = (kind, x, y, buttons) =>
  svg.dispatchEvent(new PointerEvent(kind, { clientX: x, clientY: y, buttons, bubbles: true }));
drag("pointerdown", 300, 300, 1);
drag("pointermove", 360, 320, 1);
drag("pointerup", 360, 320, 0);
svg.dispatchEvent(new MouseEvent("click", { clientX: 360, clientY: 320, bubbles: true }));
seen.dragged = { moved: place(0)[0] !== before[0], kept: document.querySelectorAll("[aria-selected='true']").length };
key(svg, "Escape", false);
key(svg, "ArrowRight", false);
seen.stepped = { chosen: chosen(), dots: svg.querySelectorAll("g.dot.chosen").length > 0 };
// Another table of the page, by keyboard alone: its headers are buttons.
const criteria = [...document.querySelectorAll("table")].find((table) => table.tHead.textContent.startsWith("criterion"));
const names = () => [...criteria.tBodies[0].rows].map((row) => row.cells[0].textContent);
const head = criteria.querySelector("thead button");
head.focus();
seen.focused = document.activeElement === head;
head.click();
seen.names = names();
seen.problems = problems;
answer(seen);
"#;

#[test]
fn a_three_dimensional_front_rotates_by_keys_and_by_dragging_and_other_tables_sort_too() {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let third = r#"criteria.error={itae={signal="y",target=1.0},usage="minimise",demand=10}"#;
    let mut run = cargo_bin_cmd!("mops");
    run.args(["pareto", "pid-pareto", "--points", "3", "--max-evaluations", "600", "--quiet", "--set", third]);
    run.args(["--out", out.to_str().unwrap()]).assert().success();
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    let message = answer(&browser, folder.path(), &page, TURNED);
    // One dot per point, and one of another colour on the point nearest to the demands.
    assert!(message["rows"].as_u64().unwrap() >= 3 && message["dots"].as_u64() > message["rows"].as_u64(), "{message}");
    assert_eq!(message["turned"]["moved"], true, "{message}");
    assert!(message["turned"]["shapes"].as_u64().unwrap() > 20, "edges, numbers and names rotate as well: {message}");
    assert_eq!(message["turned"]["chosen"], serde_json::json!([]), "rotation selects nothing");
    assert!(message["back"].as_f64().unwrap() < 0.15, "{message}");
    assert_eq!(message["dragged"], serde_json::json!({ "moved": true, "kept": 0 }), "the end of a drag is not a click");
    assert_eq!(message["stepped"], serde_json::json!({ "chosen": ["0"], "dots": true }));
    assert_eq!(message["focused"], true);
    assert_eq!(message["names"], serde_json::json!(["error", "overshoot", "settling"]));
    assert_eq!(message["problems"], serde_json::json!([]));
}

/// Writes the report of a shipped study; returns its page.
fn report(folder: &Path, arguments: &[&str]) -> std::path::PathBuf {
    let out = folder.join("out");
    cargo_bin_cmd!("mops").args(arguments).args(["--quiet", "--out", out.to_str().unwrap()]).assert().success();
    out.join("report.html")
}

/// Functions of the page: the plots of the section on responses, the text below a plot, and its range of x.
const PLOTS: &str = r#"
const section = document.querySelector("section[aria-labelledby='responses']");
const plots = [...section.querySelectorAll(".chart")];
const text = (i) => plots[i].querySelector(".readout")?.textContent ?? "";
const range = (i) => text(i).match(/^time ([^ ]+) to ([^ ]+)/)?.slice(1).map(Number) ?? null;
const frame = (i) => { const box = plots[i].querySelector(".u-over").getBoundingClientRect();
  return [box.left, box.top, box.width, box.height]; };
const chip = (name) => [...section.querySelectorAll(".chip")].find((button) => button.textContent === name);
"#;

/// Writes the report of a study and opens it at its responses, with its folder; `None` without a browser.
fn opened(arguments: &[&str]) -> Option<(tempfile::TempDir, devtools::Page)> {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = report(folder.path(), arguments);
    let mut page = devtools::Page::open(&browser, folder.path(), &format!("file://{}", file.display()));
    page.view(1200, 900, "light");
    page.once("document.querySelector(\"section[aria-labelledby='responses']\")?.scrollIntoView() ?? (document.readyState === 'complete' ? 1 : null)");
    page.evaluate(&format!("(0, eval)({})", serde_json::json!(PLOTS.replace("const ", "var "))));
    page.once("range(0)");
    Some((folder, page))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or(&Vec::new()).iter().filter_map(Value::as_f64).collect()
}

#[test]
fn a_plot_zooms_and_shows_values_by_pointer_and_by_keyboard() {
    let Some((_folder, mut page)) = opened(&["run", "pid-design-multi-case", "--max-evaluations", "40"]) else {
        return;
    };
    // The first range is the transient, with the demanded settling time of 15 s; the simulation ends at 60 s.
    let first = numbers(&page.evaluate("range(0)"));
    assert!(first[0] == 0.0 && first[1] > 15.0 && first[1] < 40.0, "{first:?}");
    // By pointer: a drag from a quarter to the half of the width shows that part, a double click the whole.
    let frame = numbers(&page.evaluate("frame(0)"));
    let at = |share: f64| [frame[0] + share * frame[2], frame[1] + 0.5 * frame[3]];
    page.drag(at(0.25), at(0.5), 1);
    page.evaluate("plots[0].querySelector('.u-over').dispatchEvent(new MouseEvent('mouseleave'))");
    let zoomed = numbers(&page.once("range(0)"));
    assert!((zoomed[0] - 0.25 * first[1]).abs() < 0.1 && (zoomed[1] - 0.5 * first[1]).abs() < 0.1, "{zoomed:?}");
    page.drag(at(0.5), at(0.5), 1);
    page.drag(at(0.5), at(0.5), 2);
    page.evaluate("plots[0].querySelector('.u-over').dispatchEvent(new MouseEvent('mouseleave'))");
    assert_eq!(numbers(&page.once("range(0)")), [0.0, 60.0]);
    // By keyboard: + halves the range, the arrows move the cursor, Escape removes it, 0 shows the whole.
    page.evaluate("plots[0].querySelector('.canvas').focus()");
    page.press("+");
    assert_eq!(numbers(&page.once("range(0)")), [15.0, 45.0]);
    page.press("Home");
    let values = page.once("/time 15 s/.test(text(0)) ? text(0) : null");
    for case in ["nominal", "worst-settling", "worst-overshoot"] {
        assert!(values.as_str().unwrap().contains(case), "{values}");
    }
    page.press("ArrowRight");
    page.once("/time 15.3 s/.test(text(0)) || null");
    page.press("Escape");
    page.press("0");
    page.once("range(0)?.[1] === 60 || null");
    // The value at the cursor is that of the curve: at the end of 60 s, the loop has settled at 1 with integral action.
    page.press("End");
    let last = page.once("text(0).match(/nominal ([0-9.]+)/)?.[1] ?? null");
    assert!((last.as_str().unwrap().parse::<f64>().unwrap() - 1.0).abs() < 1e-3, "{last}");
    assert_eq!(page.problems(), [""; 0]);
}

#[test]
fn curves_of_cases_are_switched_off_and_other_signals_on_and_plots_share_their_range() {
    let Some((_folder, mut page)) = opened(&["run", "pid-design-multi-case", "--max-evaluations", "40"]) else {
        return;
    };
    page.evaluate("plots[0].querySelector('.canvas').focus()");
    page.evaluate("chip('nominal').click(); chip('initial guess').click()");
    assert_eq!(page.evaluate("chip('nominal').getAttribute('aria-pressed')"), "false");
    page.press("ArrowRight");
    let values = page.once("/worst/.test(text(0)) ? text(0) : null");
    assert!(!values.as_str().unwrap().contains("nominal") && !values.as_str().unwrap().contains("initial"), "{values}");
    page.evaluate("chip('nominal').click()");
    page.once("/nominal/.test(text(0)) || null");
    page.press("Escape");
    // Another signal of the model.
    assert_eq!(page.evaluate("plots.filter((plot) => plot.closest('figure').hidden).length > 0"), true);
    page.evaluate(
        "var list = section.querySelector('select'); list.value = 'u'; list.dispatchEvent(new Event('change'))",
    );
    page.once("section.querySelector(\"figure[data-signal='u'] .uplot\") ? 1 : null");
    page.evaluate("var other = plots.findIndex((plot) => plot.closest('figure').dataset.signal === 'u')");
    page.evaluate("plots[0].querySelector('.canvas').focus()");
    page.press("+");
    page.once("range(0)[1] - range(0)[0] < 20 ? 1 : null");
    assert_eq!(page.evaluate("range(other)"), page.evaluate("range(0)"), "both plots show the same range");
    page.press("ArrowRight");
    page.once("/nominal/.test(text(other)) ? 1 : null");
    assert_eq!(page.problems(), [""; 0]);
}

#[test]
fn a_report_fits_a_phone_and_a_dark_screen() {
    let Some((_folder, mut page)) = opened(&["run", "step-identification", "--max-evaluations", "40"]) else { return };
    page.view(390, 844, "dark");
    page.once("document.documentElement.scrollWidth <= 390 ? 1 : null");
    page.once("plots[0].querySelector('.uplot').getBoundingClientRect().width <= 390 ? 1 : null");
    // Rows of a wide table are cards whose cells have labels.
    let label = "getComputedStyle(document.querySelector('.cards td'), '::before').content";
    assert_ne!(page.evaluate(label), "none");
    assert_eq!(page.evaluate("getComputedStyle(document.querySelector('.cards tr')).display"), "grid");
    // The measurement is beside the simulation, and the SVG is kept for printing and for browsers without scripts.
    assert!(
        page.evaluate("chip('measured') !== undefined && plots.every((plot) => plot.querySelector('svg'))")
            .as_bool()
            .unwrap()
    );
    assert_eq!(page.problems(), [""; 0]);
}
