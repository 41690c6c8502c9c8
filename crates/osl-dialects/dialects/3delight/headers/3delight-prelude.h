// What compiled files of 3Delight have without an include, beside the standard header.

#ifndef PRELUDE_3DELIGHT_H
#define PRELUDE_3DELIGHT_H

#include "stdosl.h"

// Returns its closure, and records it as the picture layer of this name.
closure color outputvariable(string name, closure color c) [[int builtin = 1]];

closure color hair_component(string component, float a, float b, float c) [[int builtin = 1]];
closure color hair(vector direction, float a, color tint, closure color c) [[int builtin = 1]];
closure color isotropic() [[int builtin = 1]];
closure color absorption() [[int builtin = 1]];
closure color henyey_greenstein(float g) [[int builtin = 1]];

#endif
