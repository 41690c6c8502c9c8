//! Random image files: headers that are almost right, sizes that exceed any memory, truncated data.
//!
//! Most files from [`texture`] are well-formed, so that they pass the first check of a decoder and reach the
//! next; some are valid images. This module must not know what reads the files.

use crate::dice::Dice;
use std::io::Write;

/// A file name and the bytes of the file. The same bytes give the same file; missing bytes count as zeros.
pub fn texture(bytes: &[u8]) -> (String, Vec<u8>) {
    let mut dice = Dice::new(bytes);
    let (ending, mut file) = match dice.below(12) {
        0 => ("png", png(&mut dice)),
        1 => ("exr", exr(&mut dice)),
        2 => ("tif", tiff(&mut dice)),
        3 => ("hdr", hdr(&mut dice)),
        4 => ("jpg", jpeg(&mut dice)),
        5 => ("tga", with_data(tga(&mut dice), &mut dice)),
        6 => ("bmp", with_data(bmp(&mut dice), &mut dice)),
        7 => ("gif", with_data(gif(&mut dice), &mut dice)),
        8 => ("webp", with_data(webp(&mut dice), &mut dice)),
        9 => ("ppm", with_data(pnm(&mut dice), &mut dice)),
        10 => ("dds", with_data(dds(&mut dice), &mut dice)),
        _ => ("exr", exr(&mut dice)),
    };
    // Truncated, or damaged in a few places.
    if dice.one_in(4) {
        let length = dice.below(file.len() as u64 + 1) as usize;
        file.truncate(length);
    }
    for _ in 0..if dice.one_in(3) { dice.below(6) } else { 0 } {
        let at = dice.below(file.len() as u64) as usize;
        let byte = dice.byte();
        if let Some(old) = file.get_mut(at) {
            *old = byte;
        }
    }
    let name = match dice.below(8) {
        0 => format!("../t.1001.{ending}"),
        1 => format!("t.1001.{ending}"),
        _ => format!("t.{ending}"),
    };
    (name, file)
}

fn deflated(dice: &mut Dice<'_>, length: u64) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    let fill = if dice.one_in(2) { 0 } else { dice.byte() };
    // A decompression bomb of up to 4 MB.
    let _ = encoder.write_all(&vec![fill; length.min(1 << 22) as usize]);
    encoder.finish().unwrap_or_default()
}

fn png(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height) = (dice.side(), dice.side());
    let depth = dice.pick(&[8, 8, 16, 1, 2, 4, 7]);
    let color = dice.pick(&[0, 2, 3, 4, 6, 5]);
    let interlaced = u8::from(dice.one_in(4));
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[depth, color, 0, 0, interlaced]].concat();
    chunk(&mut file, b"IHDR", &head);
    if color == 3 || dice.one_in(6) {
        let palette = vec![dice.byte(); 3 * dice.below(300) as usize];
        chunk(&mut file, b"PLTE", &palette);
    }
    if dice.one_in(4) {
        let alphas = vec![dice.byte(); dice.below(300) as usize];
        chunk(&mut file, b"tRNS", &alphas);
    }
    for kind in [b"iCCP", b"zTXt", b"eXIf", b"tEXt"] {
        if dice.one_in(6) {
            let length = dice.size();
            let packed = deflated(dice, length);
            chunk(&mut file, kind, &[b"x\0\0".as_slice(), &packed].concat());
        }
    }
    let samples: u64 = match color {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    let row = (u64::from(width) * samples * u64::from(depth)).div_ceil(8) + 1;
    let length = if dice.one_in(4) { dice.size() } else { row.saturating_mul(height.into()) };
    let data = deflated(dice, length);
    chunk(&mut file, b"IDAT", &data);
    chunk(&mut file, b"IEND", &[]);
    file
}

fn chunk(file: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    file.extend((data.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend(kind);
    file.extend(data);
    let mut sum = flate2::Crc::new();
    sum.update(file.get(start..).unwrap_or_default());
    file.extend(sum.sum().to_be_bytes());
}

fn exr(dice: &mut Dice<'_>) -> Vec<u8> {
    let multipart = dice.one_in(5);
    let tiled = dice.one_in(3);
    let deep = dice.one_in(12);
    let parts = if multipart { 1 + dice.below(3) } else { 1 };
    let mut flags = 2_u32;
    for (is_set, flag) in [(tiled && !multipart, 0x200), (deep, 0x800), (multipart, 0x1000)] {
        flags |= if is_set { flag } else { 0 };
    }
    let mut file = b"\x76\x2f\x31\x01".to_vec();
    file.extend(flags.to_le_bytes());
    let mut entries = 0;
    let mut block = 0;
    for part in 0..parts {
        let (width, height) = (dice.side(), dice.side());
        let compression = dice.below(11) as u8;
        let n_channels = 1 + dice.below(5);
        let mut list = Vec::new();
        let mut pixel = 0;
        for n in 0..n_channels {
            let kind = dice.pick(&[1_u32, 1, 2, 0, 3]);
            pixel += if kind == 1 { 2 } else { 4 };
            let sampling = if dice.one_in(10) { dice.side() } else { 1 };
            list.extend([b'A' + n as u8, 0]);
            list.extend([kind, u32::from(dice.one_in(5)), sampling, sampling].map(u32::to_le_bytes).concat());
        }
        list.push(0);
        attribute(&mut file, "channels", "chlist", &list);
        attribute(&mut file, "compression", "compression", &[compression]);
        let corner = if dice.one_in(5) { dice.side() as i32 } else { 0 };
        let window = |w: u32, h: u32| {
            [
                corner,
                corner,
                corner.wrapping_add_unsigned(w).wrapping_sub(1),
                corner.wrapping_add_unsigned(h).wrapping_sub(1),
            ]
            .map(i32::to_le_bytes)
            .concat()
        };
        attribute(&mut file, "dataWindow", "box2i", &window(width, height));
        let (full_width, full_height) =
            if dice.one_in(3) { (dice.side(), dice.side()) } else { (width, height) };
        attribute(&mut file, "displayWindow", "box2i", &window(full_width, full_height));
        attribute(&mut file, "lineOrder", "lineOrder", &[dice.below(3) as u8]);
        attribute(&mut file, "pixelAspectRatio", "float", &dice.float().to_le_bytes());
        attribute(&mut file, "screenWindowCenter", "v2f", &[0; 8]);
        attribute(&mut file, "screenWindowWidth", "float", &1.0_f32.to_le_bytes());
        let rows =
            [1, 1, 1, 16, 32, 16, 32, 32, 32, 256, 1].get(usize::from(compression)).copied().unwrap_or(1);
        let (mut columns, mut high) = (width, rows);
        if tiled {
            (columns, high) = (dice.side(), dice.side());
            let mode = dice.pick(&[0_u8, 1, 1, 2, 0x11, 0x13]);
            let value = [&columns.to_le_bytes()[..], &high.to_le_bytes(), &[mode]].concat();
            attribute(&mut file, "tiles", "tiledesc", &value);
        }
        if multipart {
            let kind = match (tiled, deep) {
                (false, false) => "scanlineimage",
                (true, false) => "tiledimage",
                (false, true) => "deepscanline",
                (true, true) => "deeptile",
            };
            attribute(&mut file, "type", "string", kind.as_bytes());
            attribute(
                &mut file,
                "name",
                "string",
                format!("p{}", if dice.one_in(4) { 0 } else { part }).as_bytes(),
            );
            attribute(&mut file, "chunkCount", "int", &dice.side().to_le_bytes());
        }
        for (name, value) in [("wrapmodes", "periodic,clamp"), ("oiio:AverageColor", "1,nan,inf")] {
            if dice.one_in(4) {
                attribute(&mut file, name, "string", value.as_bytes());
            }
        }
        file.push(0);
        let down = u64::from(height).div_ceil(u64::from(high.max(1)));
        let across = if tiled { u64::from(width).div_ceil(u64::from(columns.max(1))) } else { 1 };
        entries += down.saturating_mul(across).min(64);
        block =
            u64::from(columns.min(width)).saturating_mul(u64::from(high.min(height))).saturating_mul(pixel);
    }
    if multipart {
        file.push(0);
    }
    let first = file.len() as u64 + entries * 8;
    let data = match dice.below(3) {
        0 => (0..block.min(1 << 16)).map(|_| dice.byte()).collect(),
        1 => vec![0; block.min(1 << 16) as usize],
        _ => deflated(dice, block),
    };
    let mut head = 4 + if tiled { 16 } else { 4 };
    head += if multipart { 4 } else { 0 };
    let each = head + data.len() as u64;
    for n in 0..entries {
        let at = match dice.below(8) {
            0 => dice.size(),
            1 => first,
            _ => first + n * each,
        };
        file.extend(at.to_le_bytes());
    }
    for n in 0..entries.min(16) as u32 {
        if multipart {
            file.extend((dice.below(parts) as u32).to_le_bytes());
        }
        if tiled {
            file.extend([n, 0, 0, 0].map(u32::to_le_bytes).concat());
        } else {
            file.extend(n.to_le_bytes());
        }
        let length = if dice.one_in(8) { dice.side() } else { data.len() as u32 };
        file.extend(length.to_le_bytes());
        file.extend(&data);
    }
    file
}

fn attribute(file: &mut Vec<u8>, name: &str, kind: &str, value: &[u8]) {
    for word in [name, kind] {
        file.extend(word.as_bytes());
        file.push(0);
    }
    file.extend((value.len() as u32).to_le_bytes());
    file.extend(value);
}

fn tiff(dice: &mut Dice<'_>) -> Vec<u8> {
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    let pages = 1 + dice.below(4);
    let levels = dice.one_in(3);
    for page in 0..pages {
        let (width, height) = (dice.side(), dice.side());
        let samples = dice.pick(&[1_u32, 3, 4, 2, 65535]);
        let bits = dice.pick(&[8_u32, 16, 32, 1, 64, 5]);
        let start = file.len() as u32;
        let data_at = start + 2 + 16 * 12 + 4;
        let length = if dice.one_in(4) {
            dice.side()
        } else {
            (width.min(64) * height.min(64) * samples.min(4) * bits.min(64)).div_ceil(8)
        };
        let mut tags: Vec<(u16, u32)> = vec![
            (256, width),
            (257, height),
            (258, bits),
            (259, dice.pick(&[1, 5, 8, 7, 32773, 50000])),
            (262, dice.pick(&[1, 2, 0, 3, 6])),
            (277, samples),
            (284, dice.pick(&[1, 1, 2])),
            (339, dice.pick(&[1, 2, 3, 9])),
        ];
        if dice.one_in(3) {
            tags.extend([(322, dice.side()), (323, dice.side()), (324, data_at), (325, length)]);
        } else {
            tags.extend([(273, data_at), (278, dice.side()), (279, length)]);
        }
        if levels {
            tags.push((33302, 0));
        }
        if dice.one_in(3) {
            tags.push((254, dice.below(3) as u32));
        }
        tags.sort_unstable();
        file.extend((tags.len() as u16).to_le_bytes());
        for (tag, value) in &tags {
            let count = if dice.one_in(12) { dice.side() } else { 1 };
            file.extend([tag.to_le_bytes(), 4_u16.to_le_bytes()].concat());
            file.extend([count, *value].map(u32::to_le_bytes).concat());
        }
        let end = data_at + length.min(1 << 14);
        let next = match dice.below(6) {
            0 => 8,
            1 => dice.side(),
            _ if page + 1 < pages => end,
            _ => 0,
        };
        file.extend(next.to_le_bytes());
        file.resize(data_at as usize, 0);
        let fill = dice.byte();
        file.resize(end as usize, fill);
    }
    file
}

fn hdr(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height) = (dice.side(), dice.side());
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for _ in 0..height.min(8) {
        if (8..1 << 15).contains(&width) && dice.one_in(2) {
            file.extend([2, 2, (width >> 8) as u8, width as u8]);
        }
        for _ in 0..dice.below(64) {
            file.push(dice.byte());
        }
    }
    file
}

fn jpeg(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height) = (dice.side() as u16, dice.side() as u16);
    let channels = dice.pick(&[1_u8, 3, 4, 0, 2]);
    let mut file = b"\xff\xd8".to_vec();
    let table: Vec<u8> = std::iter::once(0).chain((0..64).map(|_| dice.byte() | 1)).collect();
    segment(&mut file, 0xdb, &table);
    let mut frame = [&[8][..], &height.to_be_bytes(), &width.to_be_bytes(), &[channels]].concat();
    for n in 0..channels {
        let sampling = dice.pick(&[0x11, 0x22, 0x21, 0x44, 0]);
        frame.extend([n + 1, sampling, 0]);
    }
    let kind = dice.pick(&[0xc0, 0xc2, 0xc1, 0xc9]);
    segment(&mut file, kind, &frame);
    for class in [0, 0x10] {
        let mut huffman = vec![class];
        let counts: Vec<u8> = (0..16).map(|_| dice.below(3) as u8).collect();
        let total: u32 = counts.iter().map(|n| u32::from(*n)).sum();
        huffman.extend(counts);
        huffman.extend((0..total).map(|_| dice.byte()));
        segment(&mut file, 0xc4, &huffman);
    }
    for _ in 0..1 + dice.below(4) {
        let mut scan = vec![channels];
        (0..channels).for_each(|n| scan.extend([n + 1, 0]));
        scan.extend([0, 63, 0]);
        segment(&mut file, 0xda, &scan);
        file.extend((0..dice.below(256)).map(|_| dice.byte()).collect::<Vec<u8>>());
    }
    file.extend([0xff, 0xd9]);
    file
}

fn segment(file: &mut Vec<u8>, kind: u8, data: &[u8]) {
    file.extend([0xff, kind]);
    file.extend((data.len() as u16 + 2).to_be_bytes());
    file.extend(data);
}

/// A header followed by some bytes, or by none.
fn with_data(mut file: Vec<u8>, dice: &mut Dice<'_>) -> Vec<u8> {
    file.extend((0..dice.below(300)).map(|_| dice.byte()).collect::<Vec<u8>>());
    file
}

fn short(n: u32) -> [u8; 2] {
    (n as u16).to_le_bytes()
}

fn words(list: &[u32]) -> Vec<u8> {
    list.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn tga(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height) = (short(dice.side()), short(dice.side()));
    let (map, kind) = (dice.pick(&[0, 0, 1, 2]), dice.pick(&[2, 10, 3, 11, 1, 9, 0, 32]));
    let colors = short(dice.side());
    let bits = dice.pick(&[24, 32, 16, 15, 8]);
    let head = [0, map, kind, 0, 0, colors[0], colors[1], bits, 0, 0, 0, 0];
    let depth = dice.pick(&[24, 32, 16, 15, 8, 7]);
    [&head[..], &width, &height, &[depth, dice.byte() & 0x3f]].concat()
}

fn bmp(dice: &mut Dice<'_>) -> Vec<u8> {
    let size = dice.pick(&[40, 40, 52, 56, 108, 124, 12, 64]);
    let (width, height) = (dice.side(), dice.side());
    let height = if dice.one_in(3) { height.wrapping_neg() } else { height };
    let bits = dice.pick(&[24, 32, 16, 8, 4, 1, 2, 7]);
    let offset = if dice.one_in(4) { dice.side() } else { 54 };
    let compression = dice.pick(&[0, 0, 1, 2, 3, 4, 5, 11]);
    let head =
        words(&[0, 0, offset, size, width, height, 1 | bits << 16, compression, 0, 0, 0, dice.side(), 0]);
    [b"BM", &*head].concat()
}

fn gif(dice: &mut Dice<'_>) -> Vec<u8> {
    let mut file = [b"GIF89a".as_slice(), &short(dice.side()), &short(dice.side())].concat();
    file.extend([dice.pick(&[0xf0, 0x80, 0, 0xf7]), 0, 0]);
    file.extend((0..6).map(|_| dice.byte()).collect::<Vec<u8>>());
    if dice.one_in(2) {
        file.extend([0x21, 0xf9, 4, 1, 0, 0, dice.byte() & 3, 0]);
    }
    file.push(0x2c);
    let at = if dice.one_in(4) { dice.side() } else { 0 };
    let frame = [short(at), short(at), short(dice.side()), short(dice.side())];
    file.extend(frame.as_flattened());
    file.extend([dice.pick(&[0, 0, 0x40, 0x80]), dice.pick(&[2, 8, 12, 0]), dice.byte()]);
    file
}

fn webp(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height) = (dice.side(), dice.side());
    let mut file = [b"RIFF", &*words(&[if dice.one_in(4) { dice.side() } else { 1000 }]), b"WEBP"].concat();
    if dice.one_in(2) {
        let flags = dice.pick(&[0, 0x10, 2, 0x12]);
        let sides = [dice.pick(&[width, 1, 16384]), height].map(u32::to_le_bytes);
        file.extend([b"VP8X", &*words(&[10, flags])].concat());
        sides.iter().for_each(|side| file.extend([side[0], side[1], side[2]]));
        if dice.one_in(3) {
            let alpha: Vec<u8> = (0..8).map(|_| dice.byte()).collect();
            file.extend([b"ALPH", &*words(&[8]), &alpha].concat());
        }
    }
    if dice.one_in(2) {
        let sizes = (width & 0x3fff) | (height & 0x3fff) << 14;
        file.extend([b"VP8L", &*words(&[300]), &[0x2f], &words(&[sizes])].concat());
    } else {
        file.extend([b"VP8 ", &*words(&[300]), &[dice.byte() & 0xfe, 1, 0, 0x9d, 1, 0x2a]].concat());
        file.extend([short(width), short(height)].as_flattened());
    }
    file
}

fn pnm(dice: &mut Dice<'_>) -> Vec<u8> {
    let (width, height, most) = (dice.side(), dice.side(), dice.pick(&[255, 65535, 1, 0, 7, 70000]));
    match dice.below(8) {
        kind @ (0 | 3) => format!("P{} {width} {height}\n", kind + 1),
        kind @ 1..6 => format!("P{} {width} {height} {most}\n", kind + 1),
        _ => {
            let (depth, kind) = (dice.below(6), dice.pick(&["RGB", "GRAYSCALE_ALPHA", "BLACKANDWHITE"]));
            format!(
                "P7\nWIDTH {width}\nHEIGHT {height}\nDEPTH {depth}\nMAXVAL {most}\nTUPLTYPE {kind}\nENDHDR\n"
            )
        }
    }
    .into_bytes()
}

fn dds(dice: &mut Dice<'_>) -> Vec<u8> {
    let side = |dice: &mut Dice<'_>| if dice.one_in(6) { dice.side() } else { dice.side().saturating_mul(4) };
    let mut file = [b"DDS ", &*words(&[124, 0x1007, side(dice), side(dice)])].concat();
    file.resize(76, 0);
    let code = dice.pick(&["DXT1", "DXT5", "DXT3", "DX10", "ATI2"]);
    file.extend([&*words(&[32, 4]), code.as_bytes()].concat());
    file.resize(128, 0);
    if code == "DX10" {
        file.extend(words(&[dice.pick(&[71, 77, 74, 98, 200]), 3, 0, 1, 0]));
    }
    file
}
