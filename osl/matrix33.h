// matrix33.h: matrices of 3 by 3.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.
// A matrix33 is a matrix whose fourth row and column are those of the identity.

#pragma once

#ifndef MATRIX33_H
#define MATRIX33_H

struct matrix33 {
    matrix m;
};

// Whether the fourth row and column are those of the identity.
int isValidAs33(matrix m)
{
    return m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0
        && m[3][0] == 0 && m[3][1] == 0 && m[3][2] == 0 && m[3][3] == 1;
}

// The matrix with the fourth row and column of the identity.
matrix matrix33To44(matrix33 a)
{
    return matrix(a.m[0][0], a.m[0][1], a.m[0][2], 0,
                  a.m[1][0], a.m[1][1], a.m[1][2], 0,
                  a.m[2][0], a.m[2][1], a.m[2][2], 0,
                  0, 0, 0, 1);
}

// The first three rows and columns.
matrix33 matrix44To33(matrix m)
{
    matrix33 whole = matrix33(m);
    return matrix33(matrix33To44(whole));
}

// Operators, on all sixteen elements. As in the distribution, no operator is `!=`: its function is called ne.

matrix33 __operator__neg__(matrix33 a)
{
    return matrix33(-a.m);
}

matrix33 __operator__mul__(matrix33 a, matrix33 b)
{
    return matrix33(a.m * b.m);
}

matrix33 __operator__mul__(matrix33 a, int b)
{
    return matrix33(a.m * b);
}

matrix33 __operator__mul__(int a, matrix33 b)
{
    return matrix33(a * b.m);
}

matrix33 __operator__mul__(matrix33 a, float b)
{
    return matrix33(a.m * b);
}

matrix33 __operator__mul__(float a, matrix33 b)
{
    return matrix33(a * b.m);
}

matrix33 __operator__div__(matrix33 a, matrix33 b)
{
    return matrix33(a.m / b.m);
}

matrix33 __operator__div__(matrix33 a, int b)
{
    return matrix33(a.m / b);
}

matrix33 __operator__div__(int a, matrix33 b)
{
    return matrix33(a / b.m);
}

matrix33 __operator__div__(matrix33 a, float b)
{
    return matrix33(a.m / b);
}

matrix33 __operator__div__(float a, matrix33 b)
{
    return matrix33(a / b.m);
}

int __operator__eq__(matrix33 a, matrix33 b)
{
    return a.m == b.m;
}

int __operator__ne__(matrix33 a, matrix33 b)
{
    return a.m != b.m;
}

// Functions.

float determinant(matrix33 a)
{
    return determinant(a.m);
}

matrix33 transpose(matrix33 a)
{
    return matrix33(transpose(a.m));
}

point transform(matrix33 a, point p)
{
    return transform(a.m, p);
}

vector transform(matrix33 a, vector p)
{
    return transform(a.m, p);
}

normal transform(matrix33 a, normal p)
{
    return transform(a.m, p);
}

#endif
