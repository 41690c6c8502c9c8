// oslutil.h: lines along the edges of the geometry, and text.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.
// The letters of draw_string are a font of our own with the measures of the one in the distribution (Gohu, 8 by 14).

#pragma once

#ifndef OSLUTIL_H
#define OSLUTIL_H

// 1 on the edges of the primitive, 0 elsewhere. edge_type is "polygons", "patches" or "triangles"; line_width is
// measured in pixels if raster is set, else in units of the current space. Diffuse rays see no lines.
float wireframe(string edge_type, float line_width, int raster)
{
    if (raytype("path:diffuse"))
        return 0;
    point corners[64];
    int n = 0;
    if (edge_type == "triangles") {
        if (getattribute("geom:trianglevertices", corners))
            n = 3;
    } else if (edge_type == "polygons" || edge_type == "patches") {
        int n_polygon = 0;
        if (getattribute("geom:numpolyvertices", n_polygon) && getattribute("geom:polyvertices", corners))
            n = min(n_polygon, arraylength(corners));
    }
    if (n < 3)
        return 0;
    // Half of the line's width.
    float reach = line_width / 2;
    if (raster) {
        // The size of a pixel, seen along I.
        vector right = Dx(P);
        vector up = Dy(P);
        right -= dot(right, I) * I;
        up -= dot(up, I) * I;
        reach *= (length(right) + length(up)) / 2;
    }
    point from = corners[n - 1];
    for (int i = 0; i < n; ++i) {
        point to = corners[i];
        vector edge = to - from;
        vector away = cross(edge, P - to);
        // The distance of P from the edge is the length of away divided by that of edge.
        if (dot(away, away) < dot(edge, edge) * reach * reach)
            return 1;
        from = to;
    }
    return 0;
}

float wireframe(string edge_type, float line_width)
{
    return wireframe(edge_type, line_width, 1);
}

float wireframe(string edge_type)
{
    return wireframe(edge_type, 1.0, 1);
}

float wireframe()
{
    return wireframe("polygons", 1.0, 1);
}

// Whether a pixel of a character is set. A character has 14 rows of 7 columns, the first of which is empty in all.
// Its 28 digits hold two for each row: three columns in a digit, the leftmost as its highest bit.
int __oslutil_pixel(int character, int column, int row)
{
    string rows =
        "0000101010101010001010000000"  // !
        "0022222200000000000000000000"  // "
        "0000002222772222772222000000"  // #
        "0010103651503611513610100000"  // $
        "0000205122040410224502000000"  // %
        "0000142222142443424335000000"  // &
        "0010101000000000000000000000"  // '
        "0004101020202020201010040000"  // (
        "0010040402020202020404100000"  // )
        "0000001052341034521000000000"  // *
        "0000000010101076101010000000"  // +
        "0000000000000000001414041000"  // ,
        "0000000000003600000000000000"  // -
        "0000000000000000001414000000"  // .
        "0001010202040410102020400000"  // /
        "0000364143454551614136000000"  // 0
        "0000041424040404040437000000"  // 1
        "0000364101010204102077000000"  // 2
        "0000364101011601014136000000"  // 3
        "0000020612224277020202000000"  // 4
        "0000774040760101014136000000"  // 5
        "0000162040764141414136000000"  // 6
        "0000770101020204041010000000"  // 7
        "0000364141413641414136000000"  // 8
        "0000364141413701010234000000"  // 9
        "0000000000141400001414000000"  // :
        "0000000000141400001414041000"  // ;
        "0000000204102010040200000000"  // <
        "0000000000760000760000000000"  // =
        "0000002010040204102000000000"  // >
        "0000364101020410001010000000"  // ?
        "0000364147515151474037000000"  // @
        "0000142222414177414141000000"  // A
        "0000764141417641414176000000"  // B
        "0000364140404040404136000000"  // C
        "0000744241414141414274000000"  // D
        "0000774040407640404077000000"  // E
        "0000774040407640404040000000"  // F
        "0000364140404741414335000000"  // G
        "0000414141417741414141000000"  // H
        "0000341010101010101034000000"  // I
        "0000070202020202024234000000"  // J
        "0000414244506050444241000000"  // K
        "0000404040404040404077000000"  // L
        "0000416363555541414141000000"  // M
        "0000416161515145434341000000"  // N
        "0000364141414141414136000000"  // O
        "0000764141417640404040000000"  // P
        "0000364141414141514536010000"  // Q
        "0000764141417650444241000000"  // R
        "0000364140403601014136000000"  // S
        "0000761010101010101010000000"  // T
        "0000414141414141414136000000"  // U
        "0000414141412222221414000000"  // V
        "0000414141415555636341000000"  // W
        "0000414122221422224141000000"  // X
        "0000424224241010101010000000"  // Y
        "0000770102020410204077000000"  // Z
        "0034202020202020202020340000"  // [
        "0040202010100404020201010000"  // backslash
        "0016020202020202020202160000"  // ]
        "0010244200000000000000000000"  // ^
        "0000000000000000000000007700"  // _
        "0020100400000000000000000000"  // `
        "0000000036013741414335000000"  // a
        "0000404056614141416156000000"  // b
        "0000000036414040404136000000"  // c
        "0000010135434141414335000000"  // d
        "0000000036414177404136000000"  // e
        "0000071010761010101010000000"  // f
        "0000000037414141414335010136"  // g
        "0000404056614141414141000000"  // h
        "0000100030101010101034000000"  // i
        "0000020006020202020202020234"  // j
        "0000404041424470444241000000"  // k
        "0000301010101010101006000000"  // l
        "0000000074525252525252000000"  // m
        "0000000056614141414141000000"  // n
        "0000000036414141414136000000"  // o
        "0000000056614141416156404040"  // p
        "0000000035434141414335010101"  // q
        "0000000056614040404040000000"  // r
        "0000000036414036014136000000"  // s
        "0000101076101010101007000000"  // t
        "0000000041414141414335000000"  // u
        "0000000041414122221414000000"  // v
        "0000000042425252522424000000"  // w
        "0000000041222214222241000000"  // x
        "0000000041414141414335010136"  // y
        "0000000077010214204077000000"  // z
        "0006101010102010101010060000"  // {
        "0010101010101010101010101000"  // |
        "0030040404040204040404300000"  // }
        "0000000000003146000000000000";  // ~
    if (character < 33 || character > 126 || column < 1 || column > 6 || row < 0 || row > 13)
        return 0;
    // Of the six columns left, 0 to 2 are in the first digit.
    int digit = getchar(rows, 28 * (character - 33) + 2 * row + (column - 1) / 3);
    return (digit - 48) >> (2 - (column - 1) % 3) & 1;
}

// 1 where the text covers the pixel (s, t), else 0. A character takes 8 by 14 pixels, the first column of which is
// empty. wrap_s and wrap_t repeat the text, with a gap of 14 pixels; jitter then moves it, by its bits 0 to 3 along s
// and by its bits 16 to 19 along t.
float draw_string(string text, float s, float t, int wrap_s, int wrap_t, int jitter)
{
    float x = floor(s);
    float y = floor(t);
    if (wrap_s)
        x = mod(x + (jitter & 15), (float)(8 * strlen(text) + 14));
    if (wrap_t)
        y = mod(y + (jitter >> 16 & 15), 28.0);
    // Far away the numbers would not fit an int.
    if (x < 0 || y < 0 || y >= 14 || x >= 8 * strlen(text))
        return 0;
    int column = (int)x;
    return __oslutil_pixel(getchar(text, column / 8), column % 8 - 1, (int)y);
}

#endif
