// Reads and writes channels of an image.

#ifndef GAFFEROSL_IMAGEPROCESSING_H
#define GAFFEROSL_IMAGEPROCESSING_H

float inChannel(string name, float defaultValue)
{
    float result = defaultValue;
    getattribute(name, result);
    return result;
}

closure color outChannel(string name, float value) { return debug(name, "type", "float", "value", color(value)); }

string gafferChannel(string layer, string channel)
{
    return layer == "" ? channel : concat(layer, ".", channel);
}

color inLayer(string layer, color defaultValue)
{
    return color(inChannel(gafferChannel(layer, "R"), defaultValue[0]),
                 inChannel(gafferChannel(layer, "G"), defaultValue[1]),
                 inChannel(gafferChannel(layer, "B"), defaultValue[2]));
}

closure color outLayer(string layer, color value)
{
    return outChannel(gafferChannel(layer, "R"), value[0]) + outChannel(gafferChannel(layer, "G"), value[1])
        + outChannel(gafferChannel(layer, "B"), value[2]);
}

#endif
