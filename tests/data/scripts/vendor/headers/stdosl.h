// A standard header as a vendor extends it: the built-in functions declared, functions and closures of the vendor added.
#ifndef VENDOR_STDOSL_H
#define VENDOR_STDOSL_H

#define M_PI 3.1415926535897932
#define M_2PI 6.2831853071795864
#define VENDOR_VERSION 402

#ifdef OSL_VERSION
#define BUILTIN [[int builtin = 1]]
#define BUILTIN_DERIV [[int builtin = 1, int deriv = 1]]
#else
#define BUILTIN
#define BUILTIN_DERIV
#endif

#define PERCOMP1(name) \
    normal name(normal x) BUILTIN; \
    vector name(vector x) BUILTIN; \
    point name(point x) BUILTIN; \
    color name(color x) BUILTIN; \
    float name(float x) BUILTIN;

#define PERCOMP2(name) \
    normal name(normal x, normal y) BUILTIN; \
    vector name(vector x, vector y) BUILTIN; \
    point name(point x, point y) BUILTIN; \
    color name(color x, color y) BUILTIN; \
    float name(float x, float y) BUILTIN;

float radians(float x) { return x * (M_PI / 180.0); }
color radians(color x) { return x * (M_PI / 180.0); }
PERCOMP1(sin)
PERCOMP1(cos)
PERCOMP1(floor)
PERCOMP1(abs)
int abs(int x) BUILTIN;
PERCOMP2(max)
PERCOMP2(min)
int max(int a, int b) BUILTIN;
normal fmod(normal x, float b) BUILTIN;
float fmod(float x, float b) BUILTIN;
float mod(float x, float y) { return x - y * floor(x / y); }
float clamp(float x, float low, float high) { return max(min(x, high), low); }
color mix(color x, color y, float a) BUILTIN;
float mix(float x, float y, float a) BUILTIN;
float Dx(float x) BUILTIN_DERIV;
float dot(vector a, vector b) BUILTIN;
float length(vector v) BUILTIN;
vector normalize(vector v) BUILTIN;
float noise(string type, float u) BUILTIN;
float noise(string type, point p) BUILTIN;
color noise(string type, point p) BUILTIN;
string concat(string a, string b) BUILTIN;
string concat(string a, string b, string c) { return concat(concat(a, b), c); }
int strlen(string s) BUILTIN;
int getattribute(string name, output float value) BUILTIN;
closure color diffuse(normal N) BUILTIN;
closure color emission() BUILTIN;
closure color velvet(normal N, float sigma) BUILTIN;
closure color hair_melanin(normal N, color sigma, string model) BUILTIN;

struct Ramp {
    color low;
    color high;
};
color ramp(Ramp r, float x) { return mix(r.low, r.high, clamp(x, 0.0, 1.0)); }

#endif
