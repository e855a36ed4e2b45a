"""Load capacity of gears after ISO 6336: factors, permissible stresses, damage; closed form."""
