"""What `import flexgear` offers: cases that assemble, models that are solved, results that draw."""
