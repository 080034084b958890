//! Output files of `mops linearise`: linearised.json and plots.

use std::path::Path;

use mops_content::numbers::FileNames;
use mops_linear::StateSpace;
use mops_output::Outputs;
use mops_report::Draw;
use serde_json::Value;

use crate::linear_plots;
use crate::terminal::CommandError;

/// Writes the files; returns a summary with notes on missing plots.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn write(
    (folder, outputs): (&Path, &Outputs),
    system: &StateSpace,
    content: &Value,
) -> Result<String, CommandError> {
    std::fs::create_dir_all(folder).map_err(CommandError::cannot_write(folder))?;
    let path = folder.join("linearised.json");
    let text = serde_json::to_string_pretty(content).expect("numbers and names are JSON") + "\n";
    outputs.write(&path, text).map_err(CommandError::cannot_write(&path))?;
    let (mut written, mut notes, mut names) = (0, String::new(), FileNames::default());
    for i in 0..system.inputs.len() {
        for o in 0..system.outputs.len() {
            let channel = system.channel(i, o);
            let name = format!("{}/{}", channel.outputs[0], channel.inputs[0]);
            for (kind, plot) in linear_plots::plots(&channel, &name) {
                let plot = match plot {
                    Ok(plot) => plot,
                    Err(why) => {
                        notes += &format!("note: no {kind} of {name}: {why}\n");
                        continue;
                    }
                };
                let file = names.unique(&format!("{kind}-{}-{}", channel.outputs[0], channel.inputs[0]));
                let [svg, png] = ["svg", "png"].map(|end| folder.join(format!("{file}.{end}")));
                outputs.write(&svg, plot.svg()).map_err(CommandError::cannot_write(&svg))?;
                let drawn = plot.png().and_then(|bytes| outputs.write(&png, bytes));
                drawn.map_err(CommandError::cannot_write(&png))?;
                written += 1;
            }
        }
    }
    let summary = match written {
        0 if system.inputs.is_empty() => "linearised.json is, without plots, as the system has no input,".to_owned(),
        0 if system.outputs.is_empty() => "linearised.json is, without plots, as the system has no output,".to_owned(),
        0 => "linearised.json is, without plots,".to_owned(),
        1 => "linearised.json and one plot are".to_owned(),
        _ => format!("linearised.json and {written} plots are"),
    };
    Ok(format!("\n{notes}{summary} in {}\n", folder.display()))
}
