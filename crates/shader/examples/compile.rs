//! Compiles folders of shaders and prints what each variant declares:
//! `cargo run -p afterlight-shader --features compile --example compile -- crates/techniques/src/*/`

use std::path::PathBuf;

use afterlight_shader::build::Builder;
use afterlight_shader::structs;

fn main() {
    let mut builder = Builder::new().layouts(structs::LAYOUTS);
    for folder in std::env::args_os().skip(1).map(PathBuf::from) {
        if folder.join(afterlight_shader::manifest::FILE_NAME).is_file() {
            let prefix = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let parent = folder.parent().map(PathBuf::from).unwrap_or_default();
            builder = builder.include_dir(parent).folder(prefix, folder);
        }
    }
    match builder.compile() {
        Ok(compiled) => {
            for one in compiled {
                let (shader, reflection) = (&one.shader, &one.shader.reflection);
                println!(
                    "{} {:?}: {} words, group {:?}, push {} bytes",
                    shader.name,
                    shader.stage,
                    shader.spirv.len(),
                    reflection.local_size,
                    reflection.push_constant_bytes
                );
                for b in &reflection.bindings {
                    let access = match (b.readable, b.writable) {
                        (true, true) => "read, written",
                        (true, false) => "read",
                        _ => "written",
                    };
                    println!(
                        "    set {} binding {} {} {:?} x{} {access}",
                        b.set, b.binding, b.name, b.kind, b.count
                    );
                }
            }
        }
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(1);
        }
    }
}
