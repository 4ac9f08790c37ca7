//! Files: what is written is read back; a failed write leaves nothing.

use std::{fs, path::Path};

use afterlight_image::{
    ImageError, Rgba8Image, RgbaF32Image, decode_png, psnr_db, read_exr, read_png, write_exr, write_png,
};
use proptest::prelude::*;

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn png_keeps_every_byte(width in 1u32..40, height in 1u32..20, seed: u32) {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.png");
        let pixels = (0..width * height * 4).map(|i| (i.wrapping_mul(seed | 1) >> 11) as u8).collect();
        let image = Rgba8Image::new(width, height, pixels).expect("fits");
        write_png(&file, &image).expect("written");
        prop_assert_eq!(read_png(&file).expect("read"), image);
        prop_assert_eq!(names_in(folder.path()), ["a.png"]);
    }

    #[test]
    fn exr_keeps_halves(width in 1u32..24, height in 1u32..24, scale in 1e-3f32..1e4) {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.exr");
        let pixels = (0..width * height * 4).map(|i| (i % 97) as f32 / 97.0 * scale).collect();
        let image = RgbaF32Image::new(width, height, pixels).expect("fits");
        write_exr(&file, &image).expect("written");
        let found = read_exr(&file).expect("read");
        prop_assert_eq!((found.width, found.height), (width, height));
        for (a, b) in image.pixels.iter().zip(&found.pixels) {
            // half precision: 11 bits, or 2^-25 among the smallest
            prop_assert!((a - b).abs() <= a.abs() / 2048.0 + 3e-8, "{} {}", a, b);
        }
    }

    #[test]
    fn psnr_is_symmetric_and_falls_with_the_difference(value in 0u8..200, step in 1u8..20) {
        let gray = |v: u8| Rgba8Image { width: 3, height: 2, pixels: vec![v; 24] };
        let near = psnr_db(&gray(value), &gray(value + step)).expect("sizes");
        let far = psnr_db(&gray(value), &gray(value + 2 * step)).expect("sizes");
        prop_assert!(near > far);
        prop_assert_eq!(near, psnr_db(&gray(value + step), &gray(value)).expect("sizes"));
    }

    #[test]
    fn any_bytes_are_a_png_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(decode_png(&bytes, Path::new("x.png")).is_err());
    }
}

#[test]
fn a_failed_write_leaves_nothing_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = Rgba8Image::new(1, 1, vec![1, 2, 3, 4]).expect("fits");
    // a folder of that name stands in the way of the renaming
    let occupied = folder.path().join("taken.png");
    fs::create_dir(&occupied).expect("a folder");
    fs::write(occupied.join("inside"), "x").expect("a file");
    let error = write_png(&occupied, &image).expect_err("a folder is in the way").to_string();
    assert!(error.contains("taken.png: cannot be written") && !error.contains('\n'), "{error}");
    assert_eq!(names_in(folder.path()), ["taken.png"]);
    let nowhere = folder.path().join("no/such/folder.png");
    assert!(matches!(write_png(&nowhere, &image), Err(ImageError::Io { verb: "written", .. })));
}

#[test]
fn broken_files_are_errors_of_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        fs::write(&file, bytes).expect("written");
        file
    };
    let empty = write("empty.png", b"");
    let cut = {
        let image = Rgba8Image::new(64, 64, vec![7; 64 * 64 * 4]).expect("fits");
        let whole = afterlight_image::encode_png(&image).expect("encoded");
        write("cut.png", &whole[..whole.len() / 2])
    };
    for file in [empty, cut, folder.path().to_owned(), folder.path().join("absent.png")] {
        let error = read_png(&file).expect_err("broken").to_string();
        assert!(error.contains(&*file.to_string_lossy()) && !error.contains('\n'), "{error}");
    }
    let noise = write("noise.exr", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 9, 9, 9, 9]);
    assert!(matches!(read_exr(&noise), Err(ImageError::Invalid { .. })));
    assert!(Rgba8Image::new(0, 5, vec![]).is_err());
    assert!(Rgba8Image::new(u32::MAX, u32::MAX, vec![]).is_err());
}
