// Reads and writes attributes of the points of an object.

#ifndef GAFFEROSL_OBJECTPROCESSING_H
#define GAFFEROSL_OBJECTPROCESSING_H

closure color deformation(string name) [[int builtin = 1]];

#define GAFFEROSL_IN(suffix, T) \
    T in##suffix(string name, T defaultValue) \
    { \
        T result = defaultValue; \
        getattribute(name, result); \
        return result; \
    }
GAFFEROSL_IN(Float, float)
GAFFEROSL_IN(Int, int)
GAFFEROSL_IN(Color, color)
GAFFEROSL_IN(Point, point)
GAFFEROSL_IN(Vector, vector)
GAFFEROSL_IN(Normal, normal)
GAFFEROSL_IN(Matrix, matrix)
GAFFEROSL_IN(String, string)
#undef GAFFEROSL_IN

closure color outFloat(string name, float value) { return debug(name, "type", "float", "value", color(value)); }
closure color outInt(string name, int value) { return debug(name, "type", "int", "value", color(value)); }
closure color outColor(string name, color value) { return debug(name, "type", "color", "value", value); }
closure color outVector(string name, vector value) { return debug(name, "type", "vector", "value", (color)value); }
closure color outNormal(string name, normal value) { return debug(name, "type", "normal", "value", (color)value); }
closure color outMatrix(string name, matrix value) { return debug(name, "type", "matrix", "matrixValue", value); }
closure color outString(string name, string value) { return debug(name, "type", "string", "stringValue", value); }
closure color outUV(string name, vector value) { return debug(name, "type", "uv", "value", (color)value); }

closure color outPoint(string name, point value)
{
    if (name == "P")
        return deformation(name, "type", "point", "value", (color)value);
    return debug(name, "type", "point", "value", (color)value);
}

#endif
