// Reads variables of Gaffer's context.

#ifndef GAFFEROSL_EXPRESSION_H
#define GAFFEROSL_EXPRESSION_H

#define GAFFEROSL_CONTEXT(T) \
    T context(string name, T defaultValue) \
    { \
        T result = defaultValue; \
        getattribute("gaffer:context", name, result); \
        return result; \
    } \
    T contextElement(string name, int index, T defaultValue) \
    { \
        T result = defaultValue; \
        getattribute("gaffer:context", name, index, result); \
        return result; \
    }
GAFFEROSL_CONTEXT(int)
GAFFEROSL_CONTEXT(float)
GAFFEROSL_CONTEXT(color)
GAFFEROSL_CONTEXT(vector)
GAFFEROSL_CONTEXT(string)
#undef GAFFEROSL_CONTEXT

int context(string name) { return context(name, 0); }
float context(string name) { return context(name, 0.0); }
color context(string name) { return context(name, color(0)); }
vector context(string name) { return context(name, vector(0)); }
string context(string name) { return context(name, ""); }
int contextElement(string name, int index) { return contextElement(name, index, 0); }
float contextElement(string name, int index) { return contextElement(name, index, 0.0); }
color contextElement(string name, int index) { return contextElement(name, index, color(0)); }
vector contextElement(string name, int index) { return contextElement(name, index, vector(0)); }
string contextElement(string name, int index) { return contextElement(name, index, ""); }

#endif
