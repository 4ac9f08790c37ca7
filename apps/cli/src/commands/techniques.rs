//! `afterlight techniques`

use std::fmt::Write as _;

use afterlight_techniques::{Exactness, Technique, params_of, registry, view};
use serde_json::{Value, json};

use crate::args::ListArgs;
use crate::failure::Failure;
use crate::output;

pub fn run(args: &ListArgs) -> Result<(), Failure> {
    let list: Vec<Value> = registry().iter().map(|technique| technique_json(*technique)).collect();
    output::json(&args.json, &json!({ "schema": 1, "techniques": list }))?;
    if !args.json.on_stdout() {
        for technique in registry() {
            output::print(&technique_text(*technique));
        }
    }
    Ok(())
}

fn technique_json(technique: &dyn Technique) -> Value {
    let info = technique.info();
    json!({
        "id": info.id,
        "title": info.title,
        "summary": info.summary,
        "sources": info.sources,
        "answers": info.answers,
        "appendix_a": info.appendix_a,
        "exactness": info.exactness,
        "approximations": info.approximations,
        "departures": info.departures,
        "params": params_of(technique).infos(),
        "needs": info.needs.iter().map(|need| need.name).collect::<Vec<_>>(),
        "samples": info.samples,
        "tessellation": info.tessellation,
        "views": view::of(technique),
    })
}

fn technique_text(technique: &dyn Technique) -> String {
    let info = technique.info();
    let mut text = String::new();
    let _ = writeln!(text, "{} — {}", info.id, info.title);
    let _ = writeln!(text, "   {}", info.summary);
    let sources: Vec<String> =
        info.sources.iter().map(|source| format!("{} {}", source.key, source.section)).collect();
    let _ = writeln!(text, "   sources    {}", sources.join("; "));
    let answers = &info.answers;
    for (question, answer) in [
        ("surface", answers.surface),
        ("lights", answers.lights),
        ("schedule", answers.schedule),
        ("resolve", answers.resolve),
    ] {
        let _ = writeln!(text, "   {question:<10} {answer}");
    }
    let row = &info.appendix_a;
    let _ = writeln!(
        text,
        "   appendix A {}: intersection {}, transparency {}, hardware MSAA {}, light access {}, material access {}, rates decoupled {}",
        row.id,
        row.intersect,
        row.transparency,
        row.hardware_msaa,
        row.light_access,
        row.material_access,
        row.rates_decoupled
    );
    let _ = match info.exactness {
        Exactness::Exact { min_psnr_db } => {
            writeln!(text, "   exact      at least {min_psnr_db} dB to forward at one sample")
        }
        Exactness::Approximate { bound, min_psnr_db } => {
            writeln!(text, "   approximate, {bound}; at least {min_psnr_db} dB to forward")
        }
    };
    for way in info.approximations {
        let (when, bound, least_db) = (way.when_text(), way.bound, way.min_psnr_db);
        let _ = writeln!(text, "   with {when}: approximate, {bound}; at least {least_db} dB to forward");
    }
    for departure in info.departures {
        let _ = writeln!(text, "   differs    {departure}");
    }
    let samples: Vec<String> = info.samples.iter().map(u32::to_string).collect();
    let _ = writeln!(text, "   samples    {}", samples.join(", "));
    if !info.needs.is_empty() {
        let needs: Vec<&str> = info.needs.iter().map(|need| need.name).collect();
        let _ = writeln!(text, "   needs      {}", needs.join(", "));
    }
    let views = view::of(technique);
    if !views.is_empty() {
        let _ = writeln!(text, "   views      {}", views.join(", "));
    }
    for param in params_of(technique).infos() {
        let range = param.kind.range();
        let _ = writeln!(text, "   --set {}={} ({range}): {}", param.key, param.default, param.summary);
    }
    text.push('\n');
    text
}
