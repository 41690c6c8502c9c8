// A sky without files: blue above, brown below, and a warm lamp.
color sky(vector direction) {
    vector way = normalize(direction);
    color light = mix(color(0.15, 0.11, 0.08), color(0.55, 0.7, 1.0), smoothstep(-0.1, 0.3, way[1]));
    return light + 25 * color(1, 0.85, 0.6) * smoothstep(0.97, 0.985, dot(way, normalize(vector(-0.5, 0.7, 0.6))));
}
